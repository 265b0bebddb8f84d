"""The chapter `fluid.cut`."""
