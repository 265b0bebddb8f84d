"""Does it stand? Damage of groups of blocks, what a run says about its structure at the end, and in which words."""
