"""Solids, blocks and meshes, made from the numbers of a case or from files that it names.

tank_mesh, tetrahedra             the mesh of the water
tank_regions, stretches           regions of finer cells; bricks stretched along an axis
cell_sizes                        the size of the cells at a place
basin                             a basin from a mesh file as blocks meet it
terrain                           the ground of a site, from files
start_surfaces                    surfaces of the water at the start that are not level
parts, block_files, drawing       blocks of the structure, one by one, from generators, from files, from a drawing
motions                           motions over time that blocks are told, from tables and files
town, footprints, outlines        buildings of a town, from a file of their footprints
solids, closed_surfaces           fixed solids as convex bodies
solid_ground                      how high solids raise the bed
mesh_files                        any format that meshio reads
bodies, overlaps                  where bodies are, and how deep they overlap

Imports `case` and `program`, and the geometry of `fluid` and `yade_scripts`.
"""
