"""Verification: runs of the product's own code against exact solutions and measured records.

One function a case, registered with its source and cost; each case runs in a process of its own (`one.py`), because
YADE holds one scene in a process and a crash must not take the other cases along.
"""
