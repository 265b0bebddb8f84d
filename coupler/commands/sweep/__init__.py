"""Many runs of a case: what is varied, where they run, what comes out.

names      what the schema cannot see in [sweep]
vary       --vary KEY=... as it stands on the command line
draw       samples of distributions
table_in   points of a grid from a CSV file
plan       every run with its overrides, before the first of them is made
folder     the directory of a sweep
one        make one run, or go on with it, and read it
../sweep_worker.py     a process that loads the program once and makes one run after the other
local, slurm, dask, snakemake     where they run
quantities numbers of a run
results    the table of all runs
fit, bands, fragility     fragility curves
sensitivity               on which distribution a quantity depends
page       the report; figures are made by coupler/view/sweep.py
command    the command
"""
