"""A run directory made from formulas instead of a computation: a collapsing column meets a building of loose blocks.

Not physics: smooth shapes of the right size, so that writers and pictures can be tried without a solver.
"""

import itertools
import json
from pathlib import Path

import numpy as np
from skfem import MeshTet

from coupler.results.fields import BlockWriter, WaterWriter, write_solids
from coupler.results.history import HistoryTable

GRAVITY = 9.81
BOX_FACES = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]


def box_vertices(size):
    """Corners (8, 3) of a box about its centre, in the order that BOX_FACES counts."""
    return np.array([(x, y, z) for z in (-0.5, 0.5) for y in (-0.5, 0.5) for x in (-0.5, 0.5)]) * size


def tank_mesh(size, cell):
    """Nodes (n, 3) and Kuhn tetrahedra (m, 4) of the box [0, size]."""
    mesh = MeshTet.init_tensor(*(np.linspace(0, length, round(length / cell) + 1) for length in size))
    return np.ascontiguousarray(mesh.p.T), np.ascontiguousarray(mesh.t.T)


def water_fields(nodes, time, column=(15.0, 10.0), building=(30.0, 12.0)):
    """Level set [m], velocity [m/s] and pressure [Pa] of a made-up dam break with a bulge in front of the building."""
    length, height = column
    x, y, z = nodes.T
    front = length + 1.6 * np.sqrt(GRAVITY * height) * time * (time / (time + 0.6))
    behind = np.clip((front - x) / (front - 0.35 * length), 0.0, 1.0)
    plateau = height * length / max(length, 0.62 * front)
    depth = plateau * behind**0.8 * (1 + 0.06 * np.sin(0.8 * y + 3 * time) * np.sin(0.5 * x - 4 * time))
    near = np.exp(-(((x - building[0] + 2.5) / 3.5) ** 2) - ((y - building[1]) / 6.0) ** 2)
    depth = depth + 6.5 * near * np.clip((front - building[0]) / 9.0, 0.0, 1.0) * np.exp(-0.25 * time)
    depth = np.where(depth < 0.05, -0.5, depth)
    speed = 0.9 * np.sqrt(GRAVITY * height) * np.clip(x / front, 0, 1.15) * min(1.0, time / 0.8)
    velocity = np.stack([speed, 0.2 * speed * np.sin(0.4 * (y - building[1])), 2.0 * near * speed], axis=1)
    velocity[z > depth + 1.0] = 0.0
    return z - depth, velocity, 1000 * GRAVITY * np.clip(depth - z, 0.0, None)


def wall_blocks(lower, upper, block, skip):
    """Centres and sizes of the blocks that fill a box, without those whose centre is in a `skip` box."""
    counts = np.maximum(1, np.round((upper - lower) / block)).astype(int)
    size = (upper - lower) / counts
    centres = lower + (np.array(list(itertools.product(*map(range, counts)))) + 0.5) * size
    keep = np.array([not any(np.all(c > a) and np.all(c < b) for a, b in skip) for c in centres])
    return centres[keep], np.tile(size, (int(keep.sum()), 1))


def building_blocks(corner=(28.0, 7.0, 0.0), size=(20.0, 10.0, 12.0), thickness=1.0):
    """A box of walls with a roof, a floor half way, a door and windows; blocks of about 2 x 2 x 1 m."""
    a = np.array(corner)
    b = a + np.array(size)
    t = thickness
    block = np.array([2.0, 2.0, 2.0])
    openings = [((a[0] - 1, a[1] + 4, 0.0), (a[0] + 2, a[1] + 6, 4.0))]
    openings += [((a[0] + s, a[1] - 1, z), (a[0] + s + 2.1, b[1] + 1, z + 2.4))
                 for s in (4.0, 8.0, 14.0) for z in (1.8, 7.4)]  # fmt: skip
    walls = [
        (a, np.array([a[0] + t, b[1], b[2] - t])),
        (np.array([b[0] - t, a[1], a[2]]), np.array([b[0], b[1], b[2] - t])),
        (np.array([a[0] + t, a[1], a[2]]), np.array([b[0] - t, a[1] + t, b[2] - t])),
        (np.array([a[0] + t, b[1] - t, a[2]]), np.array([b[0] - t, b[1], b[2] - t])),
        (np.array([a[0], a[1], b[2] - t]), b),
    ]
    parts = [wall_blocks(lower, upper, block, openings) for lower, upper in walls]
    groups = [("front", "back", "side", "side", "roof")[i] for i, (c, _) in enumerate(parts) for _ in c]
    return np.concatenate([c for c, _ in parts]), np.concatenate([s for _, s in parts]), groups


def block_motion(centre, time, start=0.9):
    """Centres, rotations, damage and speed: the face that the wave meets first is carried off and tumbles."""
    rng = np.random.default_rng(7)
    spin, spread = rng.normal(size=(len(centre), 3)), rng.uniform(0.6, 1.3, len(centre))
    exposed = np.clip(1 - (centre[:, 0] - 28.0) / 5.0, 0, 1) * np.clip(1.1 - centre[:, 2] / 9.0, 0, 1)
    free = np.clip(time - start - 1.2 * (1 - exposed), 0, None) * (exposed > 0.15)
    carried = 5.0 * spread * free**2 / (free + 0.5)
    moved = centre + np.stack([carried, 0.4 * spin[:, 1] * free, -0.5 * GRAVITY * 0.4 * free**2], axis=1)
    moved[:, 2] = np.maximum(moved[:, 2], np.minimum(centre[:, 2], 0.9))
    damage = np.clip(exposed * (time - start + 0.4) / 0.8, 0, 1)
    return moved, rotations(spin * free[:, None] * 0.8), damage, 5.0 * spread * (free > 0)


def rotations(angle):
    """Rotation matrices (n, 3, 3) of rotation vectors (n, 3) [rad] (Rodrigues)."""
    size = np.linalg.norm(angle, axis=1)[:, None, None]
    axis = angle / np.maximum(size[:, :, 0], 1e-300)
    cross = np.zeros((len(angle), 3, 3))
    cross[:, [0, 1, 2], [1, 2, 0]] = -axis[:, [2, 0, 1]]
    cross[:, [1, 2, 0], [0, 1, 2]] = axis[:, [2, 0, 1]]
    return np.eye(3) + np.sin(size) * cross + (1 - np.cos(size)) * cross @ cross


def write_run(run, times, water=True, blocks=True, size=(60.0, 24.0, 16.0), cell=1.0):
    """Write a run directory; returns its path."""
    run = Path(run)
    (run / "history").mkdir(parents=True)
    if water:
        write_water(run / "fields.vtkhdf", times, size, cell)
    if blocks:
        write_blocks(run / "blocks.vtkhdf", times)
    obstacle = box_vertices((2.0, 2.0, 5.0)) + np.array([22.0, 3.0, 2.5])
    tank = ((0.0, 0.0, 0.0), size) if water else None
    write_solids(run / "solids.vtkhdf", [obstacle] if water else [], [BOX_FACES] if water else [], tank)
    write_histories(run / "history", times)
    (run / "run.json").write_text(json.dumps({"case": "synthetic"}))
    return run


def write_water(path, times, size, cell):
    """The water file alone."""
    nodes, cells = tank_mesh(size, cell)
    writer = WaterWriter(path)
    for time in times:
        level_set, velocity, pressure = water_fields(nodes, time)
        fraction = np.clip(0.5 - level_set[cells].mean(axis=1) / cell, 0, 1)
        point = {"level_set": level_set, "velocity": velocity, "pressure": pressure}
        writer.append(time, nodes, cells, point, {"fluid_fraction": fraction})


def write_blocks(path, times):
    """The block file alone."""
    centre, size, groups = building_blocks()
    names = [f"{group}_{i}" for i, group in enumerate(groups)]
    writer = BlockWriter(path, [box_vertices(s) for s in size], [BOX_FACES] * len(size), names, groups)
    for time in times:
        moved, rotation, damage, speed = block_motion(centre, time)
        writer.append(time, moved, rotation, {"damage": damage, "speed": speed})


def write_histories(folder, times):
    """An energy table and a force table with smooth columns."""
    energy = [
        ("time", "s", "simulated time"),
        ("potential", "J", "of the water, above the tank floor"),
        ("kinetic", "J", "of the water"),
        ("blocks", "J", "kinetic, of the blocks"),
        ("cracks", "J", "used up by breaking joints"),
        ("error", "1", "ledger error over the first total"),
    ]
    with HistoryTable(folder / "energy.csv", energy) as table:
        for t in times:
            fall = 1.5e8 * (1 - np.exp(-t))
            table.append(
                time=t,
                potential=2e8 - fall,
                kinetic=0.9 * fall,
                blocks=0.06 * fall,
                cracks=2e6 * t,
                error=1e-4 * t,
            )
    load = [
        ("time", "s", "simulated time"),
        ("force_x", "N", "on the building, along x"),
        ("broken", "1", "joints broken so far"),
        ("volume_error", "1", "water volume over the first, minus 1"),
    ]
    with HistoryTable(folder / "load.csv", load) as table:
        for t in times:
            hit = np.clip(t - 0.9, 0, None)
            table.append(
                time=t, force_x=9e6 * hit * np.exp(-hit), broken=int(300 * hit), volume_error=-2e-3 * t
            )
