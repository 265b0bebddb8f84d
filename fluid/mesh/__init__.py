"""The chapter `fluid.mesh`."""
