"""The initial level set at the nodes of the physical domain, from the boxes of water in a case.

The top of a box may be a surface that is not level (`StartSurface`). Such a box goes on upwards to the top of the tank,
and its water ends at the surface, wherever solids are: level = max(that of the box, distance to the surface).

A fill box often ends at a wall. That side is no surface: left as it is, the level set would be zero in the face of
the wall and the water there without pressure; and beside a thin wall the copies of its nodes on the dry side would
count as wet. So a side of a box counts at a node only where water and air can meet in the cells around it:

    s = distance to the side, negative inside;  [s_low, s_high] over the fluid part of the cells around the node
    a solid that faces the side cuts these cells short on the outer side, |s_high| < t, or s ≥ 0 and s_high < t
                                                            →  s ← -far             wet up to the solid: no side
    one cuts them short on the inner side, s_low > -t       →  s ← max(s, +2 c)     dry from the solid on

c: cell edge, t = TOUCHES c. Elsewhere s stays, so that a level surface stays a plane up to the wall.

Not so at the water line on a slanting face, which leaves the last copies of nodes behind it slivers that hardly reach
across the surface: where no face around a node lies along the side, and a cell around it is one of nodes whose cells
reach farther than t beyond the side, s stays, too. Wet or dry, such nodes bent the surface, and still water moved.

Sides that follow an outer edge of a solid cut no cells short at a node beside that edge; but where no fluid part of the
cells around a node is dry for lying beyond a side alone, this is no surface there either (`_hidden_sides`).

The top of a box goes on through solids at the surface. Below a plate, or the lowest part of a raft, that dips less
than a cell into the water, the nodes on its lower side lie above the surface, behind its face. At its edges the surface
shows, and its cells hold nodes of both kinds: a node that is wet below the plate beside one that is dry above it bend
the surface, and hydrostatics would have to pull at the wet one. So the plane goes on through the solid, from its edges
to its middle (`_through_solids`), and these nodes are dry: the pressure of the plane acts on the face below them. Where
no edge shows the surface, under a lid from wall to wall, the water has none.

An edge of a box that lies on planes of nodes has all corners of some cells on the surface, where the diagonal of the
bricks runs across the edge, and cells without a corner in the water are dry: half a brick along the edge. There the
nodes on the edge lie in the water, by EDGE of a cell: a tenth of a brick too much instead of half of one too little. By
next to nothing it would be the exact volume, but one that no small motion of the surface keeps: where all corners are
close to it, whether such a cell is full or empty depends on the sign of one of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from array_types import Array
from coupler.geometry.start_surfaces import StartSurface
from fluid.domain.quadrature import part_points
from fluid.numerics.spans import spans

if TYPE_CHECKING:
    from fluid.domain.physical_domain import PhysicalDomain

TOUCHES = 0.1
"""Share of a cell edge within which the side of a box counts as the face of the solid."""
FLAT = 0.99
"""Cosine of the angle to the side of a box within which a face lies along it: it rises by TOUCHES in a cell or so."""
MISSING = 0.05
"""Share of a cell edge that a solid must take off the cells around a node to count."""
FLUSH = 0.01
"""Share of a cell edge by which a solid may stand beyond the end of a box that is meant to reach up to it."""
SEAM = 1e-6
"""Share of a cell edge within which two boxes touch."""
EDGE = 0.1
"""Share of a cell edge by which a node on an edge of a box lies in the water where cells would be lost."""
NO_CELLS, NO_BOUNDS = np.zeros(0, np.int64), np.zeros((0, 3))


class _Box(NamedTuple):
    """lower, upper (3,) [m]; top: its surface where it is not level, and then upper[2] lies above the tank."""

    lower: Sequence[float]
    upper: Sequence[float]
    top: StartSurface | None = None

    def above(self, points: Array, slack: float = 0.0) -> Array:
        """Which of the points (n, 3) lie more than slack [m] above a surface that is not level, (n,) bool."""
        return np.zeros(len(points), bool) if self.top is None else points[:, 2] > self.top(points) + slack


def start_level(boxes, tank, mesh, domain, tops=()) -> Array:
    """Level set (N,) [m] of the union of the boxes at the nodes of a PhysicalDomain, negative in the water.

    boxes: list of (lower (3,), upper (3,)) [m] · tank: (lower, upper) of the tank, whose walls are no surfaces either ·
    tops: of the first boxes the surface (`StartSurface`), None where it is level.
    """
    low, high = _reach(domain.nodes, domain.cells, *_fluid_extent(domain))
    edge = _cell_edge(mesh)
    boxes = _with_tops(boxes, tops, tank, SEAM * edge)
    whole_low, whole_high = _reach(mesh.nodes, mesh.cells)
    edges = edge * _relative_size(mesh)[domain.parent_node]
    cut_low = low - whole_low[domain.parent_node] > MISSING * edges[:, None]
    cut_high = whole_high[domain.parent_node] - high > MISSING * edges[:, None]
    faced_low, faced_high = _facing(domain)
    stars = (domain.nodes, low, high, cut_low & faced_low, cut_high & faced_high)
    hidden, goes_through = _hidden_sides(boxes, tank, domain, FLUSH * edge, SEAM * edge)
    found = [
        _box_level(box, tank, stars, domain, edges, *of, through)
        for box, of, through in zip(boxes, hidden, goes_through)
    ]
    levels = np.array([of_box for of_box, _ in found])
    for box, of_box in zip(boxes, levels):
        if box.top is not None:
            np.maximum(of_box, box.top.distance(domain.nodes, 0.5 * edge), out=of_box)
    level = levels.min(axis=0)
    inner = np.array([_goes_on(box, tank, *of) for box, of in zip(boxes, hidden)])
    others = np.where(inner, np.inf, levels).min(axis=0)  # a surface near the node is one of theirs
    deep = inner.any(axis=0)
    level[deep] = np.where(others < 0.0, np.maximum(others, -edges), -edges)[deep]
    level = _without_seams(level, boxes, tank, domain.nodes, edge)
    return _with_edges(level, np.any([at_edge for _, at_edge in found], axis=0), domain.cells, edges)


def _with_tops(boxes, tops, tank, slack: float) -> list[_Box]:
    """Adjacent boxes under the same surface are merged; boxes whose surface is not level end above the tank."""
    above = max(tank[1][2], *(high[2] for _, high in boxes)) + 1.0
    under: dict[object, list] = {}
    for (low, high), top in zip(boxes, [*tops, *[None] * (len(boxes) - len(tops))]):
        end = high if top is None else (*high[:2], above)
        under.setdefault(None if top is None else top.heights, []).append((low, end))
    found = []
    for heights, own in under.items():
        for low, high in merged(own, slack):
            top = None if heights is None else StartSurface(heights, np.array(low), np.array(high))
            found.append(_Box(low, high, top))
    return found


class _Corners:
    """Corners of the fluid parts of the cells: their nodes that no solid covers, and those of its wetted polygons."""

    def __init__(self, domain) -> None:
        self._domain, d = domain, domain
        self._shown = ~_behind(d)
        self.points = np.concatenate([d.nodes, d.face_corners.reshape(-1, 3)])
        self.beside = np.zeros(len(d.nodes), bool)
        self.beside[d.cells[d.is_cut]] = True
        """(N,) bool: nodes of cut cells."""

    def around(self, found) -> Array:
        """Nodes (N,) bool with one of the points `found` (bool) in a cell around them, or around their neighbours: a
        plane is one in the nodes that a solid covers, too."""
        d, n = self._domain, len(self._domain.nodes)
        within = np.zeros(len(d.cells), bool)
        for a in range(4):
            within |= found[d.cells[:, a]] & self._shown[:, a]
        np.logical_or.at(within, d.face_cell, found[n:].reshape(len(d.face_cell), -1).any(axis=1))
        for _ in range(2):
            nodes = np.zeros(n, bool)
            nodes[d.cells[within]] = True
            within = _any_at(d.cells, nodes)
        return nodes


def _hidden_sides(
    boxes, tank, domain, slack: float, seam: float
) -> tuple[list[tuple[Array, Array]], list[Array]]:
    """Of each box the lower and upper sides, (N, 3) bool each, that are no surface near a node of a cut cell: no corner
    of the fluid parts near it is dry for lying beyond this side alone, give or take slack [m], while some are in the
    box; and of each box the nodes (N,) bool at which its top goes on through a solid (`_through_solids`)."""
    none = np.zeros((len(domain.nodes), 3), bool)
    if not domain.is_cut.any():
        return [(none, none)] * len(boxes), [none[:, 0]] * len(boxes)
    corners, (tank_low, tank_high) = _Corners(domain), tank
    dry = ~np.any([_in_box(box, tank, corners.points, slack) for box in boxes], axis=0)
    hidden, goes_through = [], []
    for box in boxes:
        low, high = np.array(box.lower), np.array(box.upper)
        below = (corners.points < low - slack) & (low > tank_low)
        above = (corners.points > high + slack) & (high < tank_high)
        beyond = below.sum(axis=1) + above.sum(axis=1) + box.above(corners.points, slack)
        meets = corners.beside & corners.around(beyond == 0)
        sides = []
        for past in (below, above):
            seen = [corners.around(past[:, k] & dry & (beyond == 1)) for k in range(3)]
            sides.append(meets[:, None] & ~np.stack(seen, axis=1))
        through = none[:, 0]
        if box.top is None and box.upper[2] < tank_high[2]:
            through = _through_solids(domain, box.upper[2], corners.beside & seen[2], seam)
            sides[1][:, 2] &= ~through
        hidden.append((sides[0], sides[1]))
        goes_through.append(through)
    return hidden, goes_through


def _through_solids(domain, top: float, seen, slack: float) -> Array:
    """Nodes (N,) bool at which a surface at the height `top` [m] goes on through the solids that it meets: from the
    nodes `seen` (N,) bool beside which it shows, from cell to cell that a solid cuts and that reaches the surface on
    either side, give or take slack [m]."""
    z, cells = domain.nodes[:, 2], domain.cells[domain.is_cut]
    meets = (z[cells].min(axis=1) < top + slack) & (z[cells].max(axis=1) > top - slack)
    cells = cells[meets]
    found, reached, before = np.zeros(len(z), bool), seen, -1
    while reached.sum() > before:
        before = reached.sum()
        found[cells[reached[cells].any(axis=1)]] = True
        reached = seen | found
    return found


def _any_at(cells, found) -> Array:
    """Cells (M,) bool with one of the nodes `found` (N,) bool: corner by corner, which takes a quarter of the time of
    all four at once."""
    within = found[cells[:, 0]]
    for a in range(1, 4):
        within |= found[cells[:, a]]
    return within


def _behind(domain) -> Array:
    """Corners (M, 4) bool of the cells that a solid covers."""
    d, behind = domain, np.zeros(domain.cells.shape, bool)
    to_corner = d.nodes[d.cells[d.face_cell]] - d.face_centroid[:, None]
    np.logical_or.at(behind, d.face_cell, np.einsum("sak,sk->sa", to_corner, d.face_normal) < 0.0)
    return behind


def merged(boxes, slack: float) -> list:
    """Merge adjacent boxes that form one box together: the distance to a side where boxes touch would take water away
    between nodes. slack [m]: tolerance within which bounds are equal."""
    found, before = [np.array(box, float) for box in boxes], len(boxes) + 1
    while len(found) < before:
        before = len(found)
        for axis in range(3):
            found = _joined_along(axis, found, slack)
    return [(tuple(low), tuple(high)) for low, high in np.array(found).tolist()]


def _joined_along(axis: int, boxes: list[Array], slack: float) -> list[Array]:
    """Merge boxes (2, 3) that meet along an axis and have the same bounds across it."""
    rows: dict[tuple, list[Array]] = {}
    for box in boxes:
        across = np.delete(box, axis, axis=1)
        rows.setdefault(tuple(np.round(across / slack).ravel()), []).append(box)
    joined: list[Array] = []
    for row in rows.values():
        row.sort(key=lambda box: box[0, axis])
        joined.append(row[0].copy())
        for box in row[1:]:
            if box[0, axis] <= joined[-1][1, axis] + slack:
                joined[-1][1, axis] = max(joined[-1][1, axis], box[1, axis])
            else:
                joined.append(box.copy())
    return joined


def start_velocity(boxes, velocities, nodes) -> Array | None:
    """Velocity (N, 3) [m/s] at nodes (N, 3): of the box in which a node lies deepest, else of the nearest box.

    boxes: as in `start_level` · velocities: of the first of them, the others are at rest; None if all are."""
    if not np.any(velocities):
        return None
    moving = np.zeros((len(boxes), 3))
    moving[: len(velocities)] = velocities
    outside = [np.maximum(np.array(low) - nodes, nodes - np.array(high)).max(axis=1) for low, high in boxes]
    return moving[np.argmin(outside, axis=0)]


def _facing(domain) -> tuple[Array, Array]:
    """(N, 3) bool each: nodes with a solid around them whose face looks up, or down, each axis: a side of a box can
    only end at such a one, not where a wall across it cuts the cells short."""
    up, down = np.zeros(domain.nodes.shape, bool), np.zeros(domain.nodes.shape, bool)
    for a in range(4):
        corner = domain.cells[domain.face_cell, a]
        np.logical_or.at(up, corner, domain.face_normal > 0.5)
        np.logical_or.at(down, corner, domain.face_normal < -0.5)
    return up, down


def _without_seams(level, boxes, tank, nodes, edge: float) -> Array:
    """The level (N,), negative also where boxes touch: the distance to both is zero on their common face."""
    step = SEAM * edge
    at = np.flatnonzero(np.abs(level) < step)
    around = [nodes[at] + offset for offset in product((-step, step), repeat=3)]
    held = np.array([[_in_box(box, tank, points) for points in around] for box in boxes])
    # within one box there is no seam: zero is what a copy of the node beyond a wall has from its own box
    at = at[held.any(axis=0).all(axis=0) & ~held.all(axis=1).any(axis=0)]
    if len(at) > 0:
        ways = [_reach_of(boxes, tank, nodes[at], k, sign, step) for k in range(3) for sign in (-1, 1)]
        under = [-box.top.distance(nodes[at], 0.5 * edge) for box in boxes if box.top is not None]
        if under:
            ways.append(np.max(under, axis=0))
        level[at] = -np.min(ways, axis=0)
    return level


def _with_edges(level, at_edge, cells, edge: Array) -> Array:
    """The level (N,), negative at nodes on edges of boxes beside cells that would have none of its corners in the water
    for lying on the surface with all of them."""
    on_surface = _close_to(level, edge)
    lost = np.zeros(len(level), bool)
    lost[cells[on_surface[cells].all(axis=1)]] = True
    lost &= at_edge & on_surface
    level[lost] = -EDGE * edge[lost]
    return level


def _reach_of(boxes, tank, points, axis: int, sign: int, step: float) -> Array:
    """How far (n,) [m] the union of the boxes reaches from points (n, 3) in it along an axis."""
    way, whole = np.zeros(len(points)), np.ptp(np.array(tank))
    for box in list(boxes) * len(boxes):  # from box to box, at most through all of them
        ahead = points.copy()
        ahead[:, axis] += sign * (way + step)
        end = (box.lower if sign < 0 else box.upper)[axis]
        goes_on = end <= tank[0][axis] if sign < 0 else end >= tank[1][axis]
        far = whole if goes_on else sign * (end - points[:, axis])
        way = np.where(_in_box(box, tank, ahead, 0.5 * step), np.maximum(way, far), way)
    return way


def _in_box(box, tank, points, slack: float = 0.0) -> Array:
    """(n,) bool: inside the box, which goes on beyond the walls of the tank that it reaches."""
    box_low, box_high, (tank_low, tank_high) = np.array(box.lower), np.array(box.upper), np.array(tank)
    low = np.where(box_low > tank_low, box_low - slack, -np.inf)
    high = np.where(box_high < tank_high, box_high + slack, np.inf)
    return np.all((points > low) & (points < high), axis=1) & ~box.above(points, slack)


class _Faces(NamedTuple):
    """The faces of the solids beside a side of a box: a plane across an axis, the outside of the box in the direction
    `outward` (1 or -1) along it; edge (N,) [m], cell edge at each node."""

    domain: PhysicalDomain
    axis: int
    plane: float
    outward: float
    edge: Array

    def at_water_line(self, ending, beyond, looking: float) -> Array:
        """Those of the nodes `ending` (N,) bool, at which the side seems to end, that have no face along it around
        them, looking outward (1) or inward (-1), but cells with nodes `beyond` (N,) bool."""
        d, found = self.domain, np.zeros(len(ending), bool)
        cells = d.cells[_any_at(d.cells, ending)]
        if len(cells) == 0:
            return found
        found[cells[beyond[cells].any(axis=1)]] = True
        cells = d.cells[d.face_cell]
        off = np.abs(d.face_corners[:, :, self.axis] - self.plane).max(axis=1)
        looks = self.outward * looking * d.face_normal[:, self.axis] > FLAT
        found[cells[looks[:, None] & (off[:, None] < TOUCHES * self.edge[cells])]] = False
        return found


def _box_level(
    box, tank, stars, domain, edge: Array, hidden_low: Array, hidden_high: Array, through: Array
) -> tuple[Array, Array]:
    """Signed distance (N,) of one box, its sides at solids and tank walls left out, hidden ones a cell off at least,
    its top kept at the nodes `through` (N,) bool, and which nodes (N,) bool lie on two of them."""
    nodes, low, high, cut_low, cut_high = stars
    (box_low, box_high, _), (tank_low, tank_high) = box, tank
    level, ends = np.full(len(nodes), -np.inf), np.zeros(len(nodes), np.int64)
    for k in range(3):
        x = nodes[:, k]
        if box_high[k] < tank_high[k]:
            plane = box_high[k]
            s, s_low, s_high = x - plane, low[:, k] - plane, high[:, k] - plane
            faces = _Faces(domain, k, plane, 1.0, edge)
            side = _side(s, s_low, s_high, cut_low[:, k], cut_high[:, k], faces)
            side = np.where(hidden_high[:, k], np.minimum(side, -edge), side)
            if k == 2:
                side = np.where(through, s, side)
            level, ends = np.maximum(level, side), ends + _close_to(side, edge)
        if box_low[k] > tank_low[k]:
            plane = box_low[k]
            s, s_low, s_high = plane - x, plane - high[:, k], plane - low[:, k]
            faces = _Faces(domain, k, plane, -1.0, edge)
            side = _side(s, s_low, s_high, cut_high[:, k], cut_low[:, k], faces)
            side = np.where(hidden_low[:, k], np.minimum(side, -edge), side)
            level, ends = np.maximum(level, side), ends + _close_to(side, edge)
    far = np.ptp(nodes, axis=0).max()  # a distance that no surface reaches
    return np.maximum(level, -far), ends > 1


def _close_to(side, edge: Array) -> Array:
    """Nodes (N,) bool on a side, give or take what rounding does to a place."""
    return np.abs(side) < SEAM * edge


def _goes_on(box, tank, hidden_low: Array, hidden_high: Array) -> Array:
    """Nodes (N,) bool at which no side of a box is a free surface."""
    sides_low, sides_high = np.array(box.lower) > tank[0], np.array(box.upper) < tank[1]
    if box.top is not None:
        return np.zeros(len(hidden_low), bool)
    return (
        (hidden_low | ~sides_low).all(axis=1)
        & (hidden_high | ~sides_high).all(axis=1)
        & (hidden_low | hidden_high).any(axis=1)
    )


def _side(s, s_low, s_high, cut_inner, cut_outer, faces: _Faces) -> Array:
    """Distance (N,) to one side, modified at the solids that it ends at."""
    touch = TOUCHES * faces.edge
    # a star below the surface, cut short by a slanting solid, keeps its distance
    wet = cut_outer & (s_high < touch) & ((s >= 0.0) | (s_high > -touch))
    dry = cut_inner & (s_low > -touch)
    sliver = wet & dry  # counts to the side on which it mostly lies
    wet &= ~sliver | (-s_low >= s_high)
    dry &= ~wet
    wet &= ~faces.at_water_line(wet, s_high >= touch, -1.0)
    dry &= ~faces.at_water_line(dry, s_low <= -touch, 1.0)
    return np.where(wet, -np.inf, np.where(dry, np.maximum(s, 2.0 * faces.edge), s))


def _cell_edge(mesh) -> float:
    """Longest side of the bounding boxes of the cells, the typical one [m]."""
    longest = []
    for some in spans(len(mesh.cells)):
        low, high = _extent(mesh.nodes, mesh.cells[some])
        longest.append((high - low).max(axis=1))
    return float(np.median(np.concatenate(longest)))


def _relative_size(mesh) -> Array:
    """Size of the cells at each node (N,) over the typical one: 1 in a box of equal bricks."""
    return mesh.node_size / np.median(mesh.local_size)


def _extent(nodes, cells) -> tuple[Array, Array]:
    """Bounds (m, 3) of the corners of cells (m, 4), corner by corner."""
    low = nodes[cells[:, 0]]
    high = low.copy()
    for a in range(1, 4):
        corner = nodes[cells[:, a]]
        np.minimum(low, corner, out=low)
        np.maximum(high, corner, out=high)
    return low, high


def _fluid_extent(domain) -> tuple[Array, Array, Array]:
    """The cut cells (n,), and bounds (n, 3) each of their fluid parts, whose corners are those of the wetted polygons
    and the corners of the cell in front of all of these; the points of the quadrature besides, for parts that are not
    convex."""
    d = domain
    cut = np.flatnonzero(d.is_cut)
    corners = d.nodes[d.cells[cut]]
    low, high = _extent(d.nodes, d.cells[cut])
    points = part_points(corners, d.volume[cut], d.centroid_of(cut), d.second_of(cut))
    part_low, part_high = points.min(axis=1), points.max(axis=1)
    at = np.searchsorted(cut, d.face_cell)
    ours = np.flatnonzero(d.is_cut[d.face_cell])  # others touch a cell of which nothing is cut off
    np.minimum.at(part_low, at[ours], d.face_corners[ours].min(axis=1))
    np.maximum.at(part_high, at[ours], d.face_corners[ours].max(axis=1))
    shown = ~_behind(d)[cut, :, None]
    part_low = np.minimum(part_low, np.where(shown, corners, np.inf).min(axis=1))
    part_high = np.maximum(part_high, np.where(shown, corners, -np.inf).max(axis=1))
    return cut, np.maximum(low, part_low), np.minimum(high, part_high)


def _reach(nodes, cells, cut=NO_CELLS, cut_low=NO_BOUNDS, cut_high=NO_BOUNDS) -> tuple[Array, Array]:
    """Lower and upper bounds (N, 3) of the cells around every node; those of some cells `cut` (n,), in order, are
    given."""
    node_low, node_high = np.full(nodes.T.shape, np.inf), np.full(nodes.T.shape, -np.inf)
    for some in spans(len(cells)):
        low, high = _extent(nodes, cells[some])
        given = slice(*np.searchsorted(cut, [some.start, some.stop]))
        low[cut[given] - some.start], high[cut[given] - some.start] = cut_low[given], cut_high[given]
        low, high = low.T.copy(), high.T.copy()
        for corner in cells[some].T.astype(np.intp, order="C"):
            for k in range(3):  # one by one and contiguous: NumPy is several times as fast then
                np.minimum.at(node_low[k], corner, low[k])
                np.maximum.at(node_high[k], corner, high[k])
    return np.ascontiguousarray(node_low.T), np.ascontiguousarray(node_high.T)
