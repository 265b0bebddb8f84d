"""The chapter `yade_scripts.yade_side`."""
