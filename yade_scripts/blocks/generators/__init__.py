"""Generators: lists of blocks from a few numbers. Blocks that shall be joined touch face to face, wholly or in part."""
