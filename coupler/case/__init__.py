"""What `case.toml` may say: tables and keys in SI units with descriptions, and the small files beside it.

case                                              the whole case, made of the tables below
structure, water, terrain, gauges                 tables of what is there and what is measured
verdict, study, sweep                             tables of rules for a structure, and of many runs of a case
types, units, materials                           the quantities in the tables, and materials by name
keys, docs, messages, editor_schema               the schema read as data; pages, refusals, JSON Schema made from it
schedule                                          output times, times of checkpoints
promises, records, inflow_records                 `expected.toml`, tables of measurements, records of inflows
formula                                           formulas of names of the case, in studies and sweeps
paths, toml_lines, toml_text                      files that a case names, lines of its keys, plain data as TOML
study_names, sweep_names                          names in a study or sweep: that they exist and are free
first_cases, templates                            small cases that `surgebreak init` writes, and their texts

Data only: no geometry is made here.  docs/case_file.md is its page.  Imports `program`.
"""
