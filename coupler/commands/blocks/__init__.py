"""Cuts a drawing into blocks, and draws the blocks of a case at its start."""
