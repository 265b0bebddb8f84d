"""The chapter `coupler.scene`."""
