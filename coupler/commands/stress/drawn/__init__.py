"""Scenes drawn at random over the whole case format, run as cases of their own and judged from their result files.

dice    numbers that follow from seed and number    basin   tank, mesh file, terrain
stream  fills, walls, inflows and seas              bodies  what stands in the scene: solids and blocks
options what most cases leave alone                 scene   one scene out of these
case    a scene as a case directory
judge   figures from the result files               trial   one run in its own process, and its verdict
shrink  a failure made small                        command many scenes, their table, and the failures kept
"""
