"""The pressure: its matrix, right hand side and bounds (theory 2.2).

projection              mass balance with moving walls, and the correction of the velocity
damping                 motions that the pressure does not see
active_cells            which nodes and cells take part
indefinite_cells        obtuse cells at the surface that would make the matrix indefinite
pressure_bound          how far the pressure may fall: to that of the air, to vapour pressure elsewhere
displaced               the water that bodies take from the nodes as they move on
waterline               the load on solids where the surface passes through their cells
partly_wet              faces on which only a share of the pressure around them acts
slits                   cracks narrower than the mesh, as conductances
films                   water under blocks that hands on the pressure of its rim
film_volume             volume and weight of that water, which count as those of the blocks

Imports `domain` and the chapters below it, never a step.
"""
