"""The chapter `coupler.step`."""
