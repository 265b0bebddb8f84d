"""The command `surgebreak sweep`: many runs of a case, on this machine or on a cluster, and their evaluation.

vary       the option --vary KEY=... of the command line
draw       samples of distributions
table_in   points of a grid from a CSV file
plan       every run with its overrides, before the first of them is made
folder     the directory of a sweep
one        makes or continues one run, and reads it
../sweep_worker.py     a process that loads the program once and makes one run after the other
local, slurm, dask, snakemake     the engines
options, time_limit       options of a cluster engine; the time limit of a job
forecast   the cost of a sweep, from its completed runs or its first steps
quantities quantities of a run
results    the table of all runs
tables     what scripts read of a sweep
fit, fragility            fragility curves
sensitivity               the dependence of a quantity on the distributions
page       the report; figures are made by coupler/commands/view/sweep.py
arguments  the arguments of the command
command    the command
"""
