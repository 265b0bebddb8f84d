"""The structure in motion: substeps, their length, energies, the state at rest (theory 1.3 to 1.5).

structure, readings       what others set up and move; what they read of it
faces_at_start            what becomes of the faces that touch as a scene begins
description               what is checked and derived from the list of blocks before it is built
substep, spin             one substep; free rotation of bodies with unequal inertias
timestep                  how long a substep may be
onset                     when a joint dies, contact takes over
equilibrium               displacements and joint forces at rest under the load of the start
sleep                     islands of blocks at rest that make no substeps; loaded if the case asks for it
energy, impulses          what acted on the blocks, and the energy and momentum it changed
state                     saved and restored, bit for bit

Imports `contact`, `joints`, `yade_side` and `blocks`.
"""
