"""A run from its start to its end, and how it goes on after a stop.

run, execute                                       the time loop; the same for the commands `run` and `resume`
directory, lock, summary                           the directory of a run, its lock, `run.json`
checkpoint, resume, array_file, fingerprint        what is saved, and whether it still belongs to the case
progress, stop, within_step                        what is reported, and the user's wish to stop
clock, left_out                                    where the processor time goes, and what was not computed
forecast                                           steps, memory and disk of a run before it begins

docs/how_it_runs.md describes it.  Imports `checks` and the chapters below it.
"""
