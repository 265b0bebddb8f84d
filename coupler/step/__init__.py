"""One coupled step (theory 3): water and structure, solved together for pressure and velocity.

coupled_step                           the order of a step, the choice of its length, and when it is taken again
exchange                               the exchange between pressure and structure, as often as the passes permit
passes                                 the passes of a step and their relaxation
immersion, cracks                      where the structure cuts the water
pressure_with_structure                the pressure system with the blocks in it
coupling_rows                          the matrix G of theory (9), a short row for each node and body
shear                                  implicit response of blocks to shear
residual                               the coupling residual, and its history over steps
step_limits, step_start, limits        when a step is taken again, and when a run ends
sides                                  the interface of the two sides that these parts use
observe                                readings of a structure for a step
record                                 what a step did, in numbers

Imports `balance`, `geometry`, `program`, `fluid` and `yade_scripts`; knows no case and writes no file.
"""
