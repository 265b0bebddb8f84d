"""From a drawing of a building to blocks: read by layers, cut into convex parts, merged, divided to a size, named."""
