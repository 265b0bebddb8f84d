"""Cases, the coupled step, results and commands: the only package that knows the water and the structure.

Its chapters, each of which imports only those below it (import contracts in pyproject.toml hold this):

    cli          the command line by a short name, `python -m coupler.cli`
    commands     what `surgebreak NAME` does, one module or package a command
    api          `import surgebreak`: cases and runs for scripts
    run          a run from its start to its end: time loop, checkpoints, resuming, the run directory
    checks       what is wrong with a case before it is run
    scene        a case becomes water, structure and what joins them
    results      histories, fields, gauges and what a case expects of them
    verdict      does the structure stand
    step         one coupled step                                                        theory 3
    balance      energy, volume and momentum, and what is missing in them                theory 4
    geometry     solids, blocks and meshes from numbers and files
    case         what `case.toml` may say
    program      errors, processes, arithmetic, versions
"""
