"""The chapter `fluid.surface`."""
