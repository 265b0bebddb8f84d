"""The command `surgebreak compare`: the same blocks with the laws of this program and with those of YADE.

plan       the laws to compare, and cases that cannot be compared
matching   parameters of the other laws of this program, matched to those of the case
own        one law of this program, in a process of its own: the structure of the case, stepped as in a run
run        all laws and substeps; the laws of YADE are run from the scripts that are written
outcome    results of a run, and their errors relative to the exact solution
report     table, CSV, JSON
arguments  the arguments of the command
command    the command: plan, runs, table, files and figure in one directory
"""
