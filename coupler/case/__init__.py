"""What `case.toml` may say: tables and keys in SI units with descriptions, and the small files beside it.

case                                              the whole case, made of the tables below
structure, water, gauges, study, types, units     the tables, and the quantities in them
keys, docs, messages                              the schema read as data; pages and refusals made from it
schedule                                          output times, times of checkpoints
promises, records, inflow_records                 `expected.toml`, tables of measurements, records of inflows
paths, toml_lines, study_names                    files that a case names, lines of its keys, names of a study

Data only: no geometry is made here.  docs/case_file.md is its page.  Imports `program`.
"""
