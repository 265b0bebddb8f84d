"""What is carried with the flow: velocity, level set and volume (theory 2.2; stabilised forms 2.6).

advection, paths_in_solids                 semi-Lagrangian transport with the MacCormack correction
velocity_transport, volume_transport       momentum and volume by the same fluxes, both conserved
swept_volume                               volume of nodes near the surface, as the surface sweeps it
landing                                    a viscous surface where it comes to dry sides
surface_momentum                           where velocity follows the momentum that the volume carries
passed_on                                  momentum of the volumes that the correction of the level set moves
supg, forms                                stabilised finite elements instead, assembled from scikit-fem forms

Imports `surface`, `domain` and the chapters below them.
"""
