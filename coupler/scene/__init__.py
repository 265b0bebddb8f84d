"""A case becomes a scene: the water, the structure, and what joins them; nothing that the case does not ask for.

build              both sides of a scene, its gauges and limits
build_water        tank, walls, inflows and seas
fill               where the water stands at the start
side_energy        the energy that sides can bring in, by which errors are measured

A section that is absent switches its module off: it is not even imported.  Imports the chapters below it.
"""
