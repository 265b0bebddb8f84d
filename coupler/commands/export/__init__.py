"""The command `surgebreak export`: results in files for ParaView from 5.11 on, xarray and Blender."""
