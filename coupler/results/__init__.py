"""What a run leaves behind: histories, fields, tables, and whether they are what the case expects.

recorder                               what is written at which time
history, columns                       CSV tables of one row a step, and their columns
fields, vtkhdf                         water and blocks for ParaView
cracks                                 the joints as a table and as surfaces
gauges, loads, gauge_windows           what a case measures
expected                               `expected.toml` against the histories
storage                                writing that a full disk does not tear

docs/results.md is its page.  Imports `step`, `balance`, `geometry`, `case` and `program`.
"""
