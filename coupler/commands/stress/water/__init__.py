"""Scenes of water alone: at rest in difficult geometries, and in violent motion."""
