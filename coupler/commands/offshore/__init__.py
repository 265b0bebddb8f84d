"""`surgebreak offshore FILE`: the sea before the coast by ANUGA, one way, to a record for a side of a case.

file       what an offshore file may say, and what is wrong with it
command    the sea as arrays, ANUGA in a process of its own, the record
in_anuga   that process
"""
