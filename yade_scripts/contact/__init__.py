"""Contact between convex blocks, and of blocks with fixed planes (theory 1.1).

law                         stiffness, damping, friction
nodes, search, edges        points of a block that meet faces of another; where, how deep; crossing edges
boxes, overlap              how far boxes lie apart; the share of two faces that lies on one another
ground                      blocks on uneven ground
springs                     forces of the contacts found, and their work
kernel, arrays              the loop over candidate pairs, on arrays
forces, state               contact of a whole structure, with its memory; the contacts there are now

Imports `yade_side` and `blocks`.
"""
