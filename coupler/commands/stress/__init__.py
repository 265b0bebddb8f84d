"""The command `surgebreak stress`: stiff and extreme scenes, each with a verdict: passed, refused with a message, or
failed.

registry  the definition of a scene, and the list   one     one scene in its own process
runner    scenes one after the other              report  table and JSON
page      tables for docs/stress.md                  flow      limits for scenes with water
structure dry scenes                                 water     water alone
coupling  water and blocks                           drawn     scenes drawn at random
arguments the arguments of the command
"""
