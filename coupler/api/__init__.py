"""The Python side: the names that `import surgebreak` offers and the commands use. Scripts change and run cases and
read runs.

This package may import everything of the coupler except its commands; the names on which scripts may rely are those of
`surgebreak.py`.
"""
