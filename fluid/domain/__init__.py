"""The chapter `fluid.domain`."""
