"""The command `surgebreak benchmark`: processor time of substeps and their parts, of whole scenes, and of YADE's laws.

scenes                  blocks of the measurements
part                    one measurement, in a process of its own (YADE holds one scene)
water, solver           a step of the water by stage; solvers for the pressure
cutting, debris         cutting a cell; debris in a coupled step
threads, machine        speed-up by threads; what threads give on this machine anyway
arguments, command      the arguments; all measurements, as a table or as JSON
"""
