"""Trapped air (docs/theory.md, 2.6): pockets, their content, and their response to the water.

Loaded only where the case asks for it (`water.air`). `pockets` finds connected parts of the air and hands on what they
hold, `gas` is the law of a pocket and of an orifice, `cushions` the rows that pockets add to the pressure of a step,
`leaks` the ways out that the mesh does not see.
Imports `domain` and `pressure`; the step calls it, it knows nothing of the step.
"""
