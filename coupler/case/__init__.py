"""The chapter `coupler.case`."""
