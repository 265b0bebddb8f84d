"""Checks of a case before it is run: all faults are found at once, each with its file, line and key.

read_case                                    from a case directory to a checked case
case                                         sections that need each other, names that must exist
remarks                                      what is allowed but should be known before the run
thin_walls                                   bodies too thin for single covers
places, motion, joints, softness             bodies, prescribed motions, joints, contacts
water, inflows                               walls and water too thin for the cells; inflows and seas
gauges                                       gauges: places, and what they would read
air, bores, inflow_volumes                   trapped air, bores where they meet a structure, volumes of inflows
arrivals, records                            waves that come after the end of the run; records of inflows
supports                                     what carries blocks: parts that hang, a ground off the floor of the tank
on_land                                      houses on a terrain above the water, or in water thin for the cells
fronts                                       fronts on dry beds with friction, over cells that are too high
gaps, insides                                gaps beside thin walls, narrower than a cell; buildings full of water
sides                                        blocks that rub on the sides of a slice
tables                                       results that would be written to one place
unit_slips                                   values for which most likely another unit was meant

A check yields (key path, message) and changes nothing.  Imports `scene` and the chapters below it.
"""
