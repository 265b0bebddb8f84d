"""The chapter `fluid.viscous`."""
