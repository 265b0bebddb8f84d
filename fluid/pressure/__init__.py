"""The chapter `fluid.pressure`."""
