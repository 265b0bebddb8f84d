"""The exact remainder of a cell when convex bodies are removed from it (theory 2.1).

bodies, candidate_pairs                convex bodies as half spaces; the cells that each may meet
cut_cells, cut_arrays, recut           the cut of all cells, and the new cut of cells whose bodies moved
pieces, polygons, fans                 convex pieces, polygons on their faces, tetrahedra of a piece
parts_of_cell                          connected parts of the water in a cell
wetted_polygons, unclaimed_faces       the faces of a piece that are surfaces of bodies
facing                                 what lies opposite to wetted polygons across the water
openings                               areas over which parts of neighbouring cells touch

Imports `mesh`.
"""
