"""The free surface: a level set, and a volume of water at the nodes that is conserved (theory 2.2).

level_set                     signed distance near the surface
closest_triangles             distances of nodes from the triangles of a surface
volume                        the conservative volume, its fluxes, and the level set corrected towards it
shift                         the shift of the surface that a volume asks for
last_shift                    what the total volume is off by after that
pools                         water that is connected
cavities                      air on walls that the water has left
extrapolation                 values continued from the water into the nodes around it
borne_momentum                momentum of the water at nodes above the surface
gradient_jump_damping         velocity of single nodes along a calm surface on meshes with obtuse cells

Imports `domain` and the chapters below it.
"""
