"""The command `surgebreak watch`: a live page about runs and sweeps in the browser of this machine."""
