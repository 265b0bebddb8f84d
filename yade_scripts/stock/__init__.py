"""YADE's own bonded laws on the same blocks, as plain YADE scripts for comparison.

There is one file for each law (cohfrict, jcfpm, cpm, mortar, frict), all with the same names inside; `scene` describes
blocks and bonds, `elastic` and `driver` are the parts that all scripts share, and `script` puts them together.
"""
