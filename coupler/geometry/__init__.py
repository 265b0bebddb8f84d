"""Solids, blocks and meshes, made from the numbers of a case or from files that it names.

tank_mesh, tetrahedra             the mesh of the water
parts, block_files                blocks of the structure, one by one, from generators, from files
solids, closed_surfaces           fixed solids as convex bodies
solid_ground                      how high solids raise the bed
mesh_files                        any format that meshio reads
bodies, overlaps                  where bodies are, and how deep they overlap

Imports `case` and `program`, and the geometry of `fluid` and `yade_scripts`.
"""
