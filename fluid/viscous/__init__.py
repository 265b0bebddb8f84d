"""Viscosity, no-slip and rough walls: the stage of a step between transport and pressure (theory 2.3).

viscosity            the stage and its right hand side
kernels              stresses as products without a matrix
solve                conjugate gradients on them
beyond               dry nodes of cut cells, which change with those in the water
strain               strain rates smoothed over the edges of the cells
wall_friction        the log law of rough walls, and Manning's for beds
columns              depth and mean velocity of the water over a bed

Loaded only where a case asks for it.  Imports `domain` and the chapters below it.
"""
