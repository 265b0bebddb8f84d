"""Balances of energy, volume and momentum of the coupled scene, and their errors (theory 4).

energy       over water, interface and structure, each term of a step, and the volume of the water
momentum     linear and angular, of the water and of the blocks that move freely

The balances only sum what both sides report and never change a step.  Imports `fluid`, lazily.
"""
