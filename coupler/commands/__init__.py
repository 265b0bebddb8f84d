"""The commands `surgebreak NAME`, each in a module or package of its own.  No other chapter may import them.

cli                        the command line: which commands there are
run, resume, check         a short command: its arguments and what it calls, in one module
init, explain, schema      the same: first cases, keys of a case, their schema for editors
kernels, test              the same: compiled kernels for other machines, the tests
NAME/arguments             the arguments of a command that has a package, which its other modules carry out
shared_options             arguments that several commands have
doctor, explain_run        is this machine ready; what a run computed
warm_up                    compiles the kernels
verify                     exact solutions and measured records (docs/benchmarks.md)
stress                     scenes that are meant to break it (docs/stress.md)
study, study_run           many runs of one case, and their errors (docs/studies.md); one of these runs
sweep, sweep_worker        many runs of a case, and their evaluation; a process that makes one after the other
compare                    the laws of other YADE users on the same structure (docs/compare.md)
benchmark                  processor time (docs/speed.md)
blocks, terrain            blocks from a drawing; tables and maps of a terrain
offshore                   the sea off the coast, by ANUGA, as a record for a side
watch                      a live page about runs and sweeps
report, pictures, view     pages and pictures, made from the files of a run
report_command             `surgebreak report`, for runs, studies and sweeps
diff                       two or more runs side by side
export                     results in files for other programs
pages, case_pages, site    pages made from code, figures on the pages of cases, all pages as HTML

`view` is a process of its own, because VTK and YADE crash in one; it imports no solver.
"""
