"""The ground of a site: rasters, points and surfaces from files as one height over every place."""
