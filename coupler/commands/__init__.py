"""The chapter `coupler.commands`."""
