"""The chapter `fluid.readings`."""
