"""The commands `surgebreak NAME`, each in a module or package of its own.  No other chapter may import them.

cli                        the command line: which commands there are
run, resume, check, ...    a short command: its arguments and what it calls, in one module
NAME/arguments             the arguments of a command that has a package, which its other modules carry out
shared_options             arguments that several commands have
doctor, explain_run        is this machine ready; what a run computed
warm_up                    compiles the kernels
verify                     exact solutions and measured records (docs/benchmarks.md)
stress                     scenes that are meant to break it (docs/stress.md)
study                      many runs of one case, and their errors (docs/studies.md)
compare                    the laws of other YADE users on the same structure (docs/compare.md)
benchmark                  processor time (docs/speed.md)
report, pictures, view     pages and pictures, made from the files of a run

`view` is a process of its own, because VTK and YADE crash in one; it imports no solver.
"""
