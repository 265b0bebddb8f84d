"""A run from start to end, and its continuation after a stop.

run, execute                                       the time loop; the same for the commands `run` and `resume`
directory, lock, summary                           the directory of a run, its lock, `run.json`
checkpoint, resume, array_file, fingerprint        saved states, and whether they still belong to the case
progress, pace                                     reports while it runs, and the time left
stop, within_step                                  the user's request to stop
clock, left_out                                    processor time by part, and parts that were not computed
forecast, cost, trapped_air, fast_openings         what a run will take, before it begins; its air and its joints
compile_ahead                                      the kernels of a case, compiled before its run

docs/how_it_runs.md describes it.  Imports `checks` and the chapters below it.
"""
