"""Scenes of water alone: at rest in hard places, and as violent as it may get."""
