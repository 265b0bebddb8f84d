"""Stiff and extreme scenes with a verdict each: passed, refused with a message, or failed.

registry  what a scene is, and the list of them   one     one scene in its own process
runner    scenes one after the other              report  table and JSON
structure dry scenes
"""
