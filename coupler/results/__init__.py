"""The chapter `coupler.results`."""
