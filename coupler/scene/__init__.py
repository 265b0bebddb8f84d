"""Builds the scene of a case: the water, the structure and their coupling, and nothing that the case does not ask for.

build              both sides of a scene, its gauges and limits
build_water        tank, walls, inflows and seas
fill               the water at the start
side_energy        the energy that inflows and seas can bring, the scale of errors

A section that is absent switches its module off: it is not even imported.  Imports the chapters below it.
"""
