"""Results in files that other programs open: ParaView from 5.11 on, xarray, Blender."""
