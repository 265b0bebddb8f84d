"""When and where the water reached the top of the tank: what is computed after that is of a tank that is too low.

An open top lets water go, so that depths and loads come out too small; a closed one is a lid that the water presses
against. Followed at the nodes at the level of the top, those aside at which water stood at the start. The surface
creeps towards a wall that holds it and hardly passes the last node, so that a quarter of a cell below the top counts as
there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from coupler.program.quantities import moment_of

if TYPE_CHECKING:
    from fluid.step.water import Water

Array = np.ndarray

NEAR = 1e-9
"""Share of the height of the tank within which a node is at its top."""
REACHED = 0.25
"""Of a cell: distance of the surface from the top at which it is there."""
NEVER = -1.0
"""In place of a time: checkpoints hold finite numbers."""


class TankTop:
    """Follows the water of a run; what it has seen goes into checkpoints."""

    def __init__(self, water: Water):
        low, self.height = water.mesh.bounds[:, 2]
        nodes = water.mesh.nodes
        self._top = np.flatnonzero(nodes[:, 2] >= self.height - NEAR * (self.height - low))
        self._places = nodes[self._top, :2]
        self._reached = REACHED * water.mesh.finest
        self._at_start = self._wet(water)
        self.first, self.place, self.share, self.share_at = NEVER, np.zeros(2), 0.0, NEVER

    def _wet(self, water: Water) -> Array:
        """(k,) bool, of the nodes at the top: water is there, at one of the copies of the node at least."""
        parent, found = water.domain.parent_node, np.zeros(len(self._top), bool)
        first, last = (np.searchsorted(parent, self._top, side) for side in ("left", "right"))
        for copy in range(int((last - first).max(initial=0))):
            has = np.flatnonzero(first + copy < last)
            own = first[has] + copy
            found[has] |= water.topology.active[own] & (water.level_set[own] < self._reached)
        return found

    def step(self, water: Water, time: float) -> bool:
        """Take the water as it is at a time [s]; whether it has reached the top in this step for the first time."""
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
        """Plain data for run.json, None where water never came there: first [s], place [x, y] and height [m], open,
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
        """Copies of what has been seen."""
        numbers = np.array([self.first, *self.place, self.share, self.share_at])
        return {"numbers": numbers, "at_start": self._at_start.copy()}

    def restore(self, saved: dict[str, Array]) -> None:
        """Return to what `save` gave."""
        self.first, x, y, self.share, self.share_at = map(float, saved["numbers"])
        self.place, self._at_start = np.array([x, y]), saved["at_start"].copy()


def reached(found: dict[str, Any]) -> str:
    """What is told when the water reaches the top."""
    x, y = found["place"]
    return (
        f"water reached the {'open' if found['open'] else 'closed'} top of the tank (z = {found['height']:g} m) at "
        f"t = {moment_of(found['first'])} near ({x:.3g}, {y:.3g}) m; {_from_then_on(found)}"
    )


def in_all(found: dict[str, Any]) -> str:
    """The same at the end of the run, with how much of the top it was."""
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
