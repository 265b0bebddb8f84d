"""The chapter `fluid.transport`."""
