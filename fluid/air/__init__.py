"""Trapped air (docs/theory.md, 2.7): pockets, their content, and their response to the water.

Loaded only where the case asks for it (`water.air`). `pockets` finds connected parts of the air and passes on their
contents, `gas` is the law of a pocket and of an orifice, `cushions` holds the rows that pockets add to the pressure
equation of a step, and `leaks` the flow through openings that the mesh does not resolve. Imports `domain` and
`pressure`; the step calls this chapter, which does not depend on the step.
"""
