"""The same blocks under our laws and YADE's own: one command, one table, one figure.

plan     which laws, and cases that cannot be compared
matching our other laws made like that of the case
own      one of our laws, in a process of its own: the structure of the case, stepped as in a run
run      all laws, all substeps; the stock ones from the scripts that are written
outcome  what a run gave, and its errors against the exact answer
report   table, CSV, JSON
"""
