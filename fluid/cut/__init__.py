"""What is left of a cell when convex bodies are taken out of it, exactly (theory 2.1).

bodies, candidate_pairs                convex bodies as half spaces; which cells each may meet
cut_cells, cut_arrays, recut           the cut of all cells, and of those again whose bodies moved
pieces, polygons, fans                 convex pieces, polygons on their faces, tetrahedra of a piece
parts_of_cell                          connected parts of the water in a cell
wetted_polygons                        which faces of a piece are the surface of which body
openings                               over which area parts of neighbouring cells touch

Imports `mesh` and `numerics`.
"""
