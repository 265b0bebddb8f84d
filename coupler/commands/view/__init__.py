"""Pictures and films, from the files of a run alone (own process: VTK and YADE cannot share one)."""
