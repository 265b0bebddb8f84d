"""The background mesh: tetrahedra that cover water, air and solids alike (the mathematical mesh of theory 2.1).

background       nodes, cells, volumes, bins for points; from a box, from arrays
gradients        gradients of the linear functions of cells, from their corners
neighbours       which cells share a face
bricks           lattices of bricks, each split into six tetrahedra
brick_sides      which edges of a cell are sides of bricks, along which volume passes
shapes           cells of one shape share their gradients
fitted_mesh      a mesh whose boundary is the bed
refinement       regions of finer cells in boxes and over beds
bisection        cells halved, conforming
arrays           arrays that belong together, as one argument of kernels

Imports `numerics`.
"""
