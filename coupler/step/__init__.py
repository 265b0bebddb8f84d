"""One coupled step (theory 3): water and structure, solved together for pressure and velocity.

coupled_step                           the order of a step, its passes, and the choice of its length
immersion, cracks                      where the structure cuts the water
pressure_with_structure                the pressure system with the blocks in it
coupling_rows                          the matrix G of theory (10), a short row for each node and body
shear                                  how blocks answer to shear
residual                               the coupling residual, and what is remembered of it
step_limits, step_start, limits        when a step is taken again, and when a run ends
sides                                  what these parts ask of the two sides together
observe                                what is read off a structure for a step

Imports `balance`, `fluid` and `yade_scripts`; knows no case and writes no file.
"""
