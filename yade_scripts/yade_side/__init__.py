"""YADE itself: how it is loaded, one body a block, and their motion as arrays.

engine       loads YADE on one thread, without side effects on the rest of the process
scene        bodies of blocks and fixed planes, moved by YADE under forces that are given to it
motion       positions and velocities of the blocks, read from YADE's bodies

The only modules that touch YADE's objects.  Imports `blocks`.
"""
