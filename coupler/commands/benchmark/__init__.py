"""What a substep costs: ours in its parts, whole scenes, and the laws of YADE at the same size, in one run.

scenes   blocks of the measurements
part     one measurement, in a process of its own (YADE holds one scene)
command  all of them, as a table or as JSON
"""
