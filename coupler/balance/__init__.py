"""The chapter `coupler.balance`."""
