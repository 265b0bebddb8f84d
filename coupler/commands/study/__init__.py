"""The command `surgebreak study`: error against run time over ladders of runs of a case, each in a process of its own.

plan       the runs, named and checked before the first of them is made
study_run  (beside this package) one run in this process, with the processor time of compilation
runner     makes the runs one after the other; completed runs are not repeated
reading    the value of a quantity in a run
reference  the reference of a quantity: exact, measured, or the finest run
results    errors of all runs
order      observed order of convergence
laws       ladders of laws, ours and YADE's own
cheapest   the cheapest setting for an error; the cost of parts of the program
report     JSON, CSV, tables
against    comparison of two studies of one case
arguments  the arguments of the command
command    the command; figures are made by coupler/commands/view/study.py
page       a study as Markdown
pages      docs/studies.md from several studies
"""
