"""The chapter `coupler.checks`."""
