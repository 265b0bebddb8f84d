"""Tables and maps of a terrain, and of the flood of a run."""
