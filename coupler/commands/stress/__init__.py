"""Stiff and extreme scenes with a verdict each: passed, refused with a message, or failed.

registry  what a scene is, and the list of them   one     one scene in its own process
runner    scenes one after the other              report  table and JSON
page      tables for docs/stress.md                  flow      what a scene with water keeps
structure dry scenes                                 water     water alone
coupling  water and blocks                           drawn     scenes drawn at random
"""
