"""Cohesive joints between faces (theory 1.2).

law, laws                     what a cohesive law is; one file a law (docs/add_a_law.md)
outside_laws                  laws of users: files, scripts, packages
cohesion, mixed_modes         parameters of the joints; how opening and sliding act together
rules                         which touching faces are joined, and with which parameters
joints                        the joints of a structure: built, moved through time, reported
kernel, forces, specialise    their loops, compiled for each law and mixed mode
fours                         four points at a time, in the same loops
arrays                        what these loops take
seals                         faces without a joint that keep water out as long as they lie on one another

Imports `blocks`.
"""
