"""The water: a free surface on a fixed tetrahedral mesh that solids cut freely (theory 2).

Its chapters, each of which imports only those below it (import contracts in pyproject.toml hold this):

    step         one step of the water, split around the pressure solve                  theory 2.2
    readings     level, pressure, velocity and flux at places
    viscous      viscosity, no-slip and rough walls                                      theory 2.3
    air          trapped air: pockets, their gas, cushions and leaks                     theory 2.7
    pressure     the pressure system                                                     theory 2.2
    transport    what velocity, level set and volume do along the flow                   theory 2.2, 2.6
    sides        walls, inflows and seas                                                 theory 2.4
    surface      level set and conservative volume                                       theory 2.2
    domain       the physical domain: covers, their numbering, the coupling matrix       theory 2.1
    cut          cells minus convex bodies, exactly                                      theory 2.1
    mesh         the background mesh
    numerics     solvers, sums, fields

It knows neither YADE, nor files, nor the case: its input and output are arrays.
"""
