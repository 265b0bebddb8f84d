"""Error against run time: a ladder of runs of a case, each in a process of its own.

plan       which runs, named and checked before any of them is made
study_run  (beside this package) one run in this process, with the processor time that compiling took
runner     runs one after the other, those that are done are not made again
reading    the number that a quantity has in a run
reference  what it is compared with: exact, measured, or the finest run
formula    formulas of names of the case
results    errors of all runs
order      observed order of convergence
cheapest   the cheapest setting for an error; what parts of the program cost
report     JSON, CSV, tables
against    two studies of one case: what got worse
command    the command; figures are made by coupler/commands/view/study.py
page       a study as Markdown
pages      docs/studies.md out of several
"""
