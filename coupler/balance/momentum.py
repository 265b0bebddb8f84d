"""The balance of momentum: linear and angular, of the water and of the blocks that move freely, over the whole scene.

    P = P_water + P_blocks = Σ lines,     each (6,): [N s] and, about one fixed point, [N m s]

A line is the momentum added since the start: weight is negative in z, and the floor that carries it is positive:

    water_weight, blocks_weight      weight
    tank, tank_shear                 sides of the tank on the water: pressure; viscosity and friction
    sides                            water that came in through open sides, inflows and seas, with the pressure there
    openings                         force on the water of the closed narrow openings (`openings = "wide"`)
    air                              trapped air on water and bodies: the force of the sides of the tank on the air
    solids                           fixed solids on the water (with a structure they are held blocks)
    held_blocks                      blocks of prescribed motion on the water and on free blocks
    ground, ground_joints            ground and tank on free blocks: by contact, and through joints
    transport ... shear_solve        errors of the scheme of the water (`fluid.step.momentum`)
    recut                            transfer of the fields of the water to newly cut cells
    lag                              moments only: the load is constant while its block moves

Impulses between water and free blocks, and between blocks, have no line, since they must cancel.  The residual, the
change of momentum that the lines do not explain, is round-off in every step; `error` is its size over the impulses
exchanged in the step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from array_types import Array, Floats

if TYPE_CHECKING:
    from fluid.step.momentum import MomentumChange
    from fluid.step.water import Water
    from yade_scripts.dynamics.impulses import Impulses
    from yade_scripts.dynamics.structure import Structure


LINES = (
    ("water_weight", "weight of the water"),
    ("blocks_weight", "weight of the blocks"),
    ("tank", "pressure of the sides of the tank on the water"),
    ("tank_shear", "viscosity and friction of the sides of the tank on the water"),
    ("sides", "water that came in less what left, with the pressure on inflows and seas"),
    ("openings", "what closes narrow openings on the water (`water.openings`)"),
    ("air", "trapped air on the water and on bodies, which the sides of the tank carry"),
    ("solids", "fixed solids on the water"),
    ("held_blocks", "held and driven blocks on water and free blocks"),
    ("ground", "ground and tank on free blocks by contact"),
    ("ground_joints", "the ground on free blocks through joints"),
    ("transport", "scheme: transport of the velocity"),
    ("volume_correction", "scheme: correction of the volume"),
    ("carried", "scheme: the part of the last pressure that is carried over acts at other places"),
    ("surface", "scheme: pressure in cells that the surface cuts"),
    ("damping", "scheme: damping of divergence"),
    ("limit", "scheme: limit of the speed"),
    (
        "slip",
        "scheme: velocity into the sides of the tank taken off, that of inflows given, after the pressure",
    ),
    ("shear_solve", "scheme: residual of the viscous solve"),
    ("recut", "scheme: fields handed to newly cut cells"),
    ("lag", "scheme: loads held on blocks that move on (moments only)"),
)
SCHEME = tuple(name for name, meaning in LINES if meaning.startswith("scheme"))
MOVING = 1e-3
"""Fraction of the present momentum that counts as exchanged: a block in free flight exchanges nothing."""


@dataclass(frozen=True, kw_only=True)
class MomentumBalance:
    """water, blocks, residual (6,) [N s, N m s] · lines: name → (6,) so far · exchanged [N s]: sum of the sizes of all
    impulses so far · scheme [1]: sum of the lines of the scheme over it · error [1]: residual of this step over the
    impulses of this step."""

    water: Floats
    blocks: Floats
    residual: Floats
    lines: dict[str, Array]
    exchanged: float
    scheme: float
    error: float


class MomentumLedger:
    """Accumulates the lines of a run. about (3,) [m]: point of the moments · reach [m]: arm that makes moments of
    impulses comparable with impulses."""

    def __init__(self, about: Array, reach: float) -> None:
        self.about, self.reach = np.array(about, float), float(reach)
        self.lines = {name: np.zeros(6) for name, _ in LINES}
        self.residual, self.exchanged = np.zeros(6), 0.0
        self.water, self.blocks = np.zeros(6), np.zeros(6)

    def start(self, water: Array | None, blocks: Array | None) -> None:
        """Set the momenta (6,) at the start; None: the scene lacks that side."""
        self.water = np.zeros(6) if water is None else water
        self.blocks = np.zeros(6) if blocks is None else blocks

    def save(self) -> dict[str, Array]:
        """The state of the balance, by name."""
        own = {name: np.array(value) for name, value in vars(self).items() if name != "lines"}
        return own | {f"line_{name}": value.copy() for name, value in self.lines.items()}

    def restore(self, saved: dict[str, Array]) -> None:
        """Return to what `save` gave."""
        self.lines = {name: saved[f"line_{name}"].copy() for name in self.lines}
        self.about, self.residual = saved["about"].copy(), saved["residual"].copy()
        self.water, self.blocks = saved["water"].copy(), saved["blocks"].copy()
        self.reach, self.exchanged = float(saved["reach"]), float(saved["exchanged"])

    def add_step(self, water: WaterStep | None, blocks: BlocksStep | None) -> MomentumBalance:
        """Add the step of each side, None for a side that the scene lacks, and return the balance."""
        before, exchanged, given = self.water + self.blocks, 0.0, np.zeros(6)
        found: dict[str, Array] = {}
        if water is not None:
            found |= water.lines | {"recut": water.change.before - self.water}
            exchanged, given, self.water = water.exchanged, water.given, water.change.after
        if blocks is not None:
            found |= blocks.lines
            lag = blocks.received - given
            found["lag"] = np.concatenate([np.zeros(3), lag[3:]])
            found["held_blocks"] = found.get("held_blocks", np.zeros(6)) + blocks.held
            exchanged, self.blocks = exchanged + blocks.exchanged, blocks.after
        for name, value in found.items():
            self.lines[name] = self.lines[name] + value
        residual = self.water + self.blocks - before - sum(found.values())
        self.residual, self.exchanged = self.residual + residual, self.exchanged + exchanged
        return self._balance(residual, exchanged)

    def _balance(self, residual: Array, exchanged: float) -> MomentumBalance:
        scale = exchanged + MOVING * (np.linalg.norm(self.water[:3]) + np.linalg.norm(self.blocks[:3]))
        size = max(np.abs(residual[:3]).max(), np.abs(residual[3:]).max() / self.reach)
        scheme = np.linalg.norm(sum(self.lines[name][:3] for name in SCHEME))
        return MomentumBalance(
            water=self.water,
            blocks=self.blocks,
            residual=self.residual.copy(),
            lines=dict(self.lines),
            exchanged=self.exchanged,
            scheme=float(scheme / self.exchanged) if self.exchanged > 0.0 else 0.0,
            error=float(size / scale) if scale > 0.0 else 0.0,
        )


@dataclass(frozen=True)
class WaterStep:
    """change: MomentumChange of the step · lines: as in LINES · given (6,): to free blocks · exchanged [N s]"""

    change: MomentumChange
    lines: dict[str, Array]
    given: Floats
    exchanged: float

    @classmethod
    def of(cls, water: Water, load: Array, dt: float, free: Array) -> WaterStep:
        """The contributions of a step that has ended under the load (n_bodies, 6) on the bodies, blocks first;
        free (n_blocks,) bool."""
        from fluid.numerics.sums import about
        from fluid.step.momentum import NUMERICAL

        assert water.report is not None  # there was a step
        change, n = water.report.momentum, len(free)
        centre = water.domain.body_centre

        def about_point(rows: Array) -> Array:
            return dt * about(water.reference, load[rows], centre[rows])

        is_free = np.append(free, np.zeros(len(load) - n, bool))
        is_held = np.append(~free, np.zeros(len(load) - n, bool))
        is_solid = np.arange(len(load)) >= n
        own = change.lines
        lines = {name: own[name] for name in ("tank", "tank_shear", "sides", "openings", "air", *NUMERICAL)}
        lines |= {
            "water_weight": own["weight"],
            "solids": -about_point(is_solid),
            "held_blocks": -about_point(is_held),
        }
        acting = [own[name][:3] for name in ("weight", "tank", "tank_shear", "sides", "openings", "air")]
        exchanged = sum(np.linalg.norm(a) for a in acting) + dt * np.linalg.norm(load[:, :3], axis=1).sum()
        return cls(change, lines, about_point(is_free), float(exchanged))


@dataclass(frozen=True, kw_only=True)
class BlocksStep:
    """after (6,): momentum of the free blocks · lines · held (6,): held blocks on free ones · received (6,): from the
    water · exchanged [N s]"""

    after: Floats
    lines: dict[str, Array]
    held: Floats
    received: Floats
    exchanged: float

    @classmethod
    def of(cls, structure: Structure, impulses: Impulses, load: Array, about: Array) -> BlocksStep:
        """The contributions of a step that has ended under the load (n, 6), with its Impulses."""
        free = ~structure.fixed
        contact, joint = (impulses.about(about, which) for which in (impulses.contact, impulses.joint))
        weight = impulses.of_weight(structure.gravity_force(), about)[free]
        received = impulses.of_held(load, about)[free]
        lines = {
            "blocks_weight": weight.sum(axis=0),
            "ground": contact.sum(axis=0),
            "ground_joints": joint.sum(axis=0),
        }
        acting = (weight, contact, joint)
        exchanged = sum(np.linalg.norm(part[:, :3], axis=1).sum() for part in acting)
        held = -(contact + joint)[~free].sum(axis=0)
        return cls(
            after=structure.momentum(about),
            lines=lines,
            held=held,
            received=received.sum(axis=0),
            exchanged=float(exchanged),
        )


def momentum_ledger(water: Water | None, structure: Structure | None) -> MomentumLedger:
    """The balance at the start of a scene, with moments about the middle of the tank, or of the blocks without water;
    either side may be None."""
    if water is not None:
        about, reach = water.reference, 0.5 * float(np.linalg.norm(np.ptp(water.mesh.bounds, axis=0)))
    else:
        assert structure is not None  # a scene has one side at least
        about = structure.centre().mean(axis=0).round(6)
        away = np.linalg.norm(structure.centre() - about, axis=1)
        radius = np.array([np.linalg.norm(v, axis=1).max() for v in structure.shape_vertices])
        reach = float((away + radius).max())
    ledger = MomentumLedger(about, reach)
    ledger.start(
        None if water is None else momentum_of_water(water),
        None if structure is None else structure.momentum(ledger.about),
    )
    return ledger


def momentum_of_water(water: Water) -> Array:
    """Present linear and angular momentum (6,) of the water."""
    from fluid.step.momentum import momentum

    return momentum(water)


def add_step(
    ledger: MomentumLedger,
    water: Water | None,
    structure: Structure | None,
    dt: float,
    load: Array,
    impulses: Impulses | None,
) -> MomentumBalance:
    """Add the step of dt [s] that has just ended on the two sides, either of which may be None.

    load (n_bodies, 6) [N, N m] of the water on the bodies, blocks first; (0, 6) without water · impulses: those of
    contacts and joints on the blocks; None without a structure."""
    free = np.zeros(0, bool) if structure is None else ~structure.fixed
    of_water = None if water is None else WaterStep.of(water, load, dt, free)
    of_blocks = None
    if structure is not None and impulses is not None:
        on_blocks = load[: structure.n] if len(load) else np.zeros((structure.n, 6))
        of_blocks = BlocksStep.of(structure, impulses, on_blocks, ledger.about)
    return ledger.add_step(of_water, of_blocks)
