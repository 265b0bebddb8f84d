"""The chapter `yade_scripts.dynamics`."""
