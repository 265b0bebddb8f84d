"""The chapter `yade_scripts.contact`."""
