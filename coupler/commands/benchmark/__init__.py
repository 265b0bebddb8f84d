"""The command `surgebreak benchmark`: processor time of substeps and their parts, of whole scenes, and of YADE's laws.

scenes   blocks of the measurements
part     one measurement, in a process of its own (YADE holds one scene)
command  all measurements, as a table or as JSON
"""
