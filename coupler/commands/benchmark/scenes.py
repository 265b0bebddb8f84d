"""Blocks of the measurements: walls with so many joints, a building, a pile."""

from __future__ import annotations

import numpy as np

from yade_scripts.blocks.block import Block
from yade_scripts.blocks.generators.building import Building, Opening, building_blocks

RATTLE = 1e-7
"""Speed [m/s] of blocks in random directions: joints open and close, none is damaged."""


def wall_edge(joints: int) -> int:
    """Edge m of the m x m wall of cubes whose number of joints, 2 m (m - 1), is nearest to the given one."""
    return max(2, round(0.5 + np.sqrt(0.25 + 0.5 * joints)))


def wall(joints: int) -> list[Block]:
    """Wall of m x m unit cubes with small random velocities."""
    m = wall_edge(joints)
    random = np.random.default_rng(1)
    velocity = random.uniform(-RATTLE, RATTLE, (m * m, 3))
    return [
        Block(f"b{i}-{k}", (i, 0.0, k + 0.5), size=1.0, velocity=velocity[i * m + k])
        for i in range(m)
        for k in range(m)
    ]


def building() -> list[Block]:
    """501 blocks: three storeys with floors and a roof."""
    return building_blocks(
        Building((0.0, 0.0), (21.0, 8.0), height=12.0, thickness=0.5, block=1.6, course=1.2, storeys=3)
    )


def houses(count: int) -> list[Block]:
    """`count` buildings of 215 blocks, 40 m by 30 m apart; the first are the rows 0 .. 214."""
    blocks: list[Block] = []
    for number in range(count):
        x, y = 40.0 * (number % 5), 30.0 * (number // 5)
        holes = [(0, 3, 0, 1, 5, 2.2), (0, 1, 4.4, 1, 3, 6.6), (0, 7, 4.4, 1, 9, 6.6)]
        holes += [(u, v, 4.4, u + 2, v + 1, 6.6) for u in (5, 13) for v in (0, 9)]
        openings = [Opening((x + a, y + b, c), (x + d, y + e, f)) for a, b, c, d, e, f in holes]
        blocks += building_blocks(
            Building(
                (x, y), (x + 20.0, y + 10.0), height=12.0, thickness=1.0, block=2.0, density=1500.0,
                name=f"house{number}", openings=openings,
            )
        )  # fmt: skip
    return blocks


def pile(edge: int = 8) -> list[Block]:
    """edge³ loose unit cubes stacked on the ground, every neighbour touching."""
    places = np.stack(np.meshgrid(*[np.arange(edge)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    return [Block(f"b{i}", p + np.array([0.0, 0.0, 0.5]), size=1.0) for i, p in enumerate(places)]
