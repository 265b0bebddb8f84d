"""The chapter `coupler.geometry`."""
