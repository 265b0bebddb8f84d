"""A block glued to the side of a held one: a case that takes a fraction of a second, or as long as a test wants."""

CASE = """\
[case]
title = "an arm"
[time]
end = "10 ms"
step_max = "2 ms"
output_every = "1 s"
checkpoint_every = "10 ms"
[structure]
substep = "5 us"
[[structure.block]]
name = "held"
size = [0.2, 0.2, 0.2]
centre = [0, 0, 1]
fixed = true
[[structure.block]]
name = "arm"
size = [0.2, 0.2, 0.2]
centre = [0.2, 0, 1]
velocity = [0, 0, 0]
[contact]
stiffness = 1e7
[joints]
strength = 1e6
opening_at_failure = "1 mm"
[[gauge]]
kind = "motion"
name = "arm"
of = "arm"
"""
WEAK = 1e3
"""Strength [Pa] with which the arm cannot stand: its weight needs 4.7 kPa in shear alone."""
