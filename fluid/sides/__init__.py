"""Sides of the tank: where water is held, enters and leaves (theory 2.4).

walls        closed sides, with free slip or no slip, and open ones
open_parts   what solids leave open of the faces of a side
inflow       sides with a given velocity, or with the level of a still sea
absorbing    sides that follow the water inside: they let waves out, or keep their discharge
waves        streams, records, bores and solitary waves that enter
outflow      what leaves through open sides

Imports `surface` and the chapters below it.
"""
