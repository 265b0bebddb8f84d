"""The chapter `fluid.numerics`."""
