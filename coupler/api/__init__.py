"""What `import surgebreak` offers, and the commands use: cases that a script changes and runs, and runs read back.

May import everything of the coupler but its commands; the names that scripts may rely on are those of `surgebreak.py`.
"""
