"""Rigid blocks: geometry, touching faces, motion of their points, generators of structures.

block, polyhedra         boxes and convex polyhedra with exact volume, centre and inertia
prescribed               motions over time that blocks are told
faces, quadrature        touching faces, and Gauss points on them
kinematics               points, velocities and forces of moving blocks
tangent                  stiffness and damping of springs between blocks, as sparse matrices
generators               columns, walls, arches, buildings, rubble

Imports nothing of the project and not YADE.
"""
