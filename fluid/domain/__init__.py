"""The physical domain: the covers of the finite cover method as an ordinary mesh (theory 2.1).

covers, continued_nodes         unknowns for each connected part of a star; the old unknown that a new one continues
physical_domain                 cells, moments and wetted surface, made from the cut
topology                        the connectivity of nodes and cells, laid out for the kernels of a step
incidence, graph                nodes and cells around one another; edges of listed nodes with their stiffness
layers                          layers of nodes around others
open_columns                    what solids leave of the columns of water
cell_vectors                    vectors of those cells that have one, as a list
moments, quadrature             volumes of water below a linear level set; points and weights in cut cells
hats                            the linear functions of a cell at points in it
coupling_matrix                 G: pressure at nodes to loads on bodies, and its transpose
point_location                  the cell that a point is in

Imports `cut`, `mesh` and `numerics`.
"""
