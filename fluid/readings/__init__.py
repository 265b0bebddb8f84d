"""Reading the water at places: level, pressure, velocity, flux through a plane, volume in a box.

gauges       level, pressure, velocity, flux and volume at given places
at_surface   pressure in cells that the surface cuts
clip         tetrahedra clipped by half spaces
closed_off   water that no air reaches
solid_spans  what solids take of upright lines

Reads a `Water` and changes nothing.  Imports `domain`, `sides` and the chapters below them.
"""
