"""Scenes of water and blocks together: very light, very many, very stiff, squeezed, breaking, in too long a step."""
