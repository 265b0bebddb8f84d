"""Does it stand? The damage of groups of blocks, and what a run says about its structure at the end.

damage         shares of joints and weight of a group, and the state they make
divisions      bodies, walls and storeys of a structure
pressed        the faces across which the pressure of the water on a block is measured
trend          whether the load of the water still grows at the end
depths         the depth of the water beside a structure
attitude       displacement and tilt of blocks at the end
rocking        blocks out of their place that their weight turns back
watch          what is followed from step to step
judge          the verdict
words          the verdict in sentences

Arrays in, so that a run, a town and a sweep can all use it.  Imports `step`, `program`, `yade_scripts` and the gauges
of `fluid`.
"""
