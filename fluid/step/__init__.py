"""One step of the water, split around the pressure solve (theory 2.2).

water, water_readings       the state, and `predict` and `correct` around the solve; what others read of it
start                       surface, velocity and fluxes at the start
moved_solids                the state carried to a domain cut anew
predictor, corrector        the two halves of a step
carried                     what the fluxes of a step carry
kick                        the last acceleration, as far as it counts in the next step
speeds                      how fast the water is, and what follows for a step
time_step                   the speed that sets the length of a step
remainders                  the part of the velocity of cells that nodes cannot represent
momentum, potential         what changed the momentum; the potential energy, and that of water at a level
report                      what a step did, in numbers
parameters                  numbers that a case may set
state                       saved and restored, bit for bit

Imports every other chapter of fluid.
"""
