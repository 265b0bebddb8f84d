"""The structure: rigid blocks, contact and cohesive joints on YADE."""
