"""The chapter `fluid.sides`."""
