"""The chapter `coupler.program`."""
