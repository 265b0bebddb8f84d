"""Results of a run: histories, fields and tables, and their comparison with what the case expects.

recorder                               what is written at which time
history, columns                       CSV tables of one row a step, and their columns
fields, vtkhdf                         water and blocks for ParaView
cracks                                 the joints as a table and as surfaces
gauges, loads, gauge_windows           what a case measures
maps, tank_top                         maps of a flood over terrain; where water reached the top of the tank
even_raster                            uneven columns as a raster for a file
damage_table, buildings_table          a row for each block, and for each building
expected, stated                       `expected.toml` and the figures of the case's README against the histories
storage                                writing that a full disk cannot leave incomplete

They are described in docs/results.md.  Imports `verdict`, `step`, `balance`, `geometry`, `case`, `program` and the
readings of `fluid`.
"""
