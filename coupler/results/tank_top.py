"""When and where the water reached the top of the tank: from then on the tank is too low for the flow.

An open top lets water go, so that depths and loads come out too small; a closed one is a lid that the water presses
against. The water is followed at the nodes at the level of the top, except those at which it stood at the start. The
surface creeps towards a wall that holds it and hardly passes the last node, so a quarter of a cell of its place below
the top counts as reached.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from array_types import Array
from coupler.program.quantities import moment_of

if TYPE_CHECKING:
    from fluid.step.water import Water


NEAR = 1e-9
"""Share of the height of the tank within which a node is at its top."""
REACHED = 0.25
"""Share of a cell: distance of the surface from the top at which the top counts as reached."""
NEVER = -1.0
"""Value in place of a time, since checkpoints hold finite numbers."""


class TankTop:
    """Follows the water of a run; its findings are stored in checkpoints."""

    def __init__(self, water: Water):
        low, self.height = water.mesh.bounds[:, 2]
        nodes = water.mesh.nodes
        self._top = np.flatnonzero(nodes[:, 2] >= self.height - NEAR * (self.height - low))
        self._places = nodes[self._top, :2]
        self._reached = REACHED * water.mesh.node_size[self._top]
        self._domain: object = None
        self._copies: list[tuple[Array, Array]] = []
        self._at_start = self._wet(water)
        self.first, self.place, self.share, self.share_at = NEVER, np.zeros(2), 0.0, NEVER

    def _wet(self, water: Water) -> Array:
        """(k,) bool: whether each node at the top, or at least one of its copies, is wet."""
        if water.domain is not self._domain:
            self._domain, self._copies = water.domain, _copies(water, self._top)
        found = np.zeros(len(self._top), bool)
        for has, own in self._copies:
            found[has] |= water.level_set[own] < self._reached[has]
        return found

    def step(self, water: Water, time: float) -> bool:
        """Update with the water at a time [s]; return whether it has reached the top for the first time in this
        step."""
        wet = np.flatnonzero(self._wet(water) & ~self._at_start)
        if not len(wet):
            return False
        share = len(wet) / len(self._top)
        if share > self.share:
            self.share, self.share_at = share, time
        if self.first != NEVER:
            return False
        self.first, self.place = time, self._places[wet].mean(axis=0)
        return True

    def reported(self, is_open: bool) -> dict[str, Any] | None:
        """Plain data for run.json, None if water never reached the top: first [s], place [x, y] and height [m], open,
        share: largest share of the top that was under water at once, share_at [s]."""
        if self.first == NEVER:
            return None
        return {
            "first": self.first,
            "place": [*map(float, self.place)],
            "height": float(self.height),
            "open": is_open,
            "share": self.share,
            "share_at": self.share_at,
        }

    def save(self) -> dict[str, Array]:
        """Copies of the findings so far."""
        numbers = np.array([self.first, *self.place, self.share, self.share_at])
        return {"numbers": numbers, "at_start": self._at_start.copy()}

    def restore(self, saved: dict[str, Array]) -> None:
        """Restore the state that `save` returned."""
        self.first, x, y, self.share, self.share_at = map(float, saved["numbers"])
        self.place, self._at_start = np.array([x, y]), saved["at_start"].copy()


def _copies(water: Water, top) -> list[tuple[Array, Array]]:
    """Of the nodes top (k,) of the mesh, the first, second, ... copies that take part: which of them have one (n,), and
    its number in the domain (n,)."""
    parent, found = water.domain.parent_node, []
    first, last = (np.searchsorted(parent, top, side) for side in ("left", "right"))
    for copy in range(int((last - first).max(initial=0))):
        has = np.flatnonzero(first + copy < last)
        has = has[water.topology.active[first[has] + copy]]
        found.append((has, first[has] + copy))
    return found


def reached(found: dict[str, Any]) -> str:
    """The message when the water reaches the top."""
    x, y = found["place"]
    return (
        f"water reached the {'open' if found['open'] else 'closed'} top of the tank (z = {found['height']:g} m) at "
        f"t = {moment_of(found['first'])} near ({x:.3g}, {y:.3g}) m; {_from_then_on(found)}"
    )


def in_all(found: dict[str, Any]) -> str:
    """The message at the end of the run, with the share of the top that was reached."""
    return (
        f"{reached(found)}. At most {100.0 * found['share']:.2g} % of the top was under water, at t = "
        f"{moment_of(found['share_at'])}"
    )


def _from_then_on(found: dict[str, Any]) -> str:
    if found["open"]:
        return (
            "what passes it is lost, so depths and loads after that may be too small: make the tank higher "
            "(tank.upper) unless it is spray"
        )
    return (
        "it acts as a lid, so pressures and loads after that are those under a lid: make the tank higher (tank.upper) "
        "unless there is one"
    )
