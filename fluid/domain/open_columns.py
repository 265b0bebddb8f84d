"""What solids leave of the columns of water: the area on which the water beside a house stands.

A column of bins holds the volume V of water over the area A in the plan. Beside a solid that stands upright in it only
a part a of A is open, and the water is V / (a A) deep. The part is that of the volume of the bin at the level of the
water, to which V fills what is open of the column from below: it is exact for upright walls, and 1 over a bed, a block
or a roof under water, where V / A stays the mean depth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Array, Floats, Ints

ROUND_OFF = 1e-9
"""Share of a cell, of a bin or of the water in a column that counts as nothing."""


@dataclass(frozen=True)
class OpenColumns:
    """The columns of bins that solids reach into: column (k,) their numbers · filled (k, nz) [m³]: what the open part
    of each holds up to the top of each bin · share (k, nz): open part of the area for water that ends in each bin."""

    column: Ints
    filled: Floats
    share: Floats

    @classmethod
    def of(cls, domain) -> OpenColumns:
        """Those of a PhysicalDomain."""
        mesh = domain.memory.mesh
        taken = np.bincount(domain.parent_cell, domain.volume, minlength=len(mesh.cells))
        np.subtract(mesh.cell_volume, taken, out=taken)
        cells = np.flatnonzero(taken > ROUND_OFF * mesh.cell_volume)
        if len(cells) == 0:
            none = np.zeros((0, len(mesh.axes[2]) - 1))
            return cls(cells, none, none)
        solid = mesh.bin_volume(cells, taken[cells])
        column = np.flatnonzero(np.diff(solid.indptr))
        total = mesh.volume_of_bins[column].toarray()
        free = total - solid[column].toarray()
        free[free <= ROUND_OFF * total] = 0.0
        return cls(column, np.cumsum(free, axis=1), _share_at(free, free / np.maximum(total, 1e-300)))

    def depth(self, volume, area) -> Array:
        """Depth (c,) [m] of volumes (c,) [m³] of water in all columns, whose areas in the plan are (c,) [m²]."""
        found, k = volume / area, self.column
        held = (1.0 - ROUND_OFF) * np.minimum(volume[k], self.filled[:, -1])
        at = (self.filled < held[:, None]).sum(axis=1)
        found[k] /= self.share[np.arange(len(k)), at]
        return found


def _share_at(free, share):
    """Open part (k, nz) of the area for water that ends in each bin: the largest share (k, nz) of what is free of the
    bins from there down, so that water under a deck or a block afloat stands on all of the area below. The bed may cut
    the lowest bin that is free; there that of the next bin counts, too. 1 where nothing is free up to there."""
    most = np.maximum.accumulate(share, axis=1)
    row, lowest = np.arange(len(free)), (free > 0.0).argmax(axis=1)
    above = np.minimum(lowest + 1, free.shape[1] - 1)
    most[row, lowest] = most[row, above]
    return np.where(most > 0.0, most, 1.0)
