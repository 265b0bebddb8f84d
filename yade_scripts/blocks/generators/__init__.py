"""Generators: lists of blocks from a few numbers. Blocks that are to be joined touch face to face, fully or in part."""
