"""Looks whether all parts of the installation work, and repairs some of them."""
