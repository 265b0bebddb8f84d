"""The chapter `yade_scripts.joints`."""
