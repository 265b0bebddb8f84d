"""The chapter `coupler.run`."""
