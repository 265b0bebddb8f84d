"""`surgebreak offshore FILE`: computes the sea off the coast with ANUGA and writes a record for a side of a case
(one-way).

arguments  the arguments of the command
file       the schema of an offshore file, and its checks
command    the sea as arrays, ANUGA in a process of its own, the record
in_anuga   that process
"""
