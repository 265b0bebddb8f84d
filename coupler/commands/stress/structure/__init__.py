"""Dry scenes: joints and contacts of rigid blocks at the ends of what they may be."""
