"""The chapter `fluid.step`."""
