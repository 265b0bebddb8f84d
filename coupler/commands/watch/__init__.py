"""A page that lives: runs and sweeps while they go on, in the browser of this machine."""
