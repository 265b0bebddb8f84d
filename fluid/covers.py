"""Multiple covers: thresholds and the virtual mesh."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Connection:
    """x"""

    inner: float = 0.0
    face: float = 0.0

    def link_area(self, spacing):
        return max(self.inner, 1e-12) * spacing**2


def virtual_cells(mesh, parent, element_of_part, cuts, connection):
    return None


def pick_old_nodes(old, new):
    return None
