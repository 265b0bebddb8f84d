"""The command `surgebreak sweep`: many runs of a case, on this machine or on a cluster, and their evaluation.

names      checks of [sweep] that the schema cannot make
vary       the option --vary KEY=... of the command line
draw       samples of distributions
table_in   points of a grid from a CSV file
plan       every run with its overrides, before the first of them is made
folder     the directory of a sweep
one        makes or continues one run, and reads it
../sweep_worker.py     a process that loads the program once and makes one run after the other
local, slurm, dask, snakemake     the engines
quantities quantities of a run
results    the table of all runs
fit, bands, fragility     fragility curves
sensitivity               the dependence of a quantity on the distributions
page       the report; figures are made by coupler/commands/view/sweep.py
command    the command
"""
