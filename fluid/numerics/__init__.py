"""Numerical tools that do not depend on the geometry of the water.

solve, multigrid      conjugate gradients for symmetric positive definite systems, and their preconditioner
bounded               the same with a lower bound on the unknowns (theory 2.2)
sums                  momentum, kinetic energy and loads of many points
fields, median        fields that a step makes anew; the median of some entries of a field
cube_root             with the same bits on every processor
spans                 rows of large arrays, some at a time

Imports `kernels` only.
"""
