"""The structure: rigid blocks with cohesive joints and contact, moved by YADE (theory 1).

Its chapters, each of which imports only those below it (import contracts in pyproject.toml hold this):

    stock        laws that YADE brings, for `surgebreak compare`
    dynamics     the structure and its substeps                                          theory 1.3, 1.4
    joints       cohesive joints and their laws                                          theory 1.2
    contact      contact of convex blocks                                                theory 1.1
    yade_side    YADE: how it is loaded, its bodies and their motion
    blocks       blocks, their faces and the generators of structures

It knows nothing of the water: its input is loads and its output positions and velocities, all of them arrays.
"""
