"""The chapter `yade_scripts.blocks`."""
