"""Reading the water at places: level, pressure, velocity, flux through a plane, volume in a box.

gauges       what is read, and where
clip         tetrahedra clipped by half spaces

Reads a `Water` and changes nothing.  Imports `domain`, `sides` and the chapters below them.
"""
