"""The schema of a case: all keys of `case.toml` in SI units, each with its description and unit.

A section that is absent switches its module off (`modules`). Unknown keys are refused. The page `docs/case_file.md` and
the command `surgebreak explain` are made from this file and from the other modules of this package.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, PrivateAttr, model_validator

from coupler.case.gauges import Gauge
from coupler.case.structure import Structure
from coupler.case.study import Study
from coupler.case.sweep import Sweep
from coupler.case.terrain import Terrain
from coupler.case.types import (
    Length,
    Name,
    Point,
    PositiveLength,
    PositiveTime,
    Section,
    Side,
    Switch,
    VelocityVector,
)
from coupler.case.units import InSI
from coupler.case.verdict import Verdict
from coupler.case.water import File, Solid, Water


class About(Section):
    """Title and description of the case, and gravity."""

    title: str = Field(description="title in one line")
    description: str = Field("", description="what the case shows, its source, and which results matter")
    gravity: Annotated[float, InSI("m/s2", ge=0)] = Field(
        9.81, description="acceleration of gravity, along -z; z points up"
    )


class Time(Section):
    """Duration, step sizes, and times of output."""

    end: PositiveTime = Field(description="the run ends at this time", examples=["4 s"])
    step_max: PositiveTime = Field(0.05, description="largest step of the coupled scheme")
    cfl: Annotated[float, InSI("", gt=0, le=10)] = Field(
        1.0,
        description="cells that the fastest water may cross in one step; sets the step up to step_max. Spray, the "
        "hundredth of the water that is more than a third faster than all the rest, may cross twice as many",
    )
    output_every: PositiveTime | None = Field(
        None,
        description="time between two written states; a step ends at each of them, so none is longer than this; "
        "absent: a hundredth of the end time",
    )
    checkpoint_every: Annotated[float, InSI("s", ge=0)] | None = Field(
        None,
        description="time between two checkpoints, from which `surgebreak resume` continues; absent: a tenth of the "
        "end time, and ten minutes of wall time at most; 0: none, also when the run is stopped",
    )


class Stretch(Section):
    """A part of one axis with bricks of another length: a tank long and coarse in one direction, or a fine layer."""

    along: Literal["x", "y", "z"] = Field(
        description="the axis along which these cells are shorter or longer"
    )
    lower: Length | None = Field(None, description="where it begins; absent: at the lower end of the tank")
    upper: Length | None = Field(None, description="where it ends; absent: at the upper end of the tank")
    cell: PositiveLength = Field(
        description="wanted length of the bricks along this axis", examples=["0.25 m"]
    )
    growth: Annotated[float, InSI("", gt=1, le=2)] = Field(
        1.2, description="largest ratio of the lengths of adjacent bricks beyond its ends"
    )


class Refine(Section):
    """Finer cells in a part of the tank: in a box (lower, upper), or around bodies and the ground (around). A level
    halves the cells in every direction; sizes change gradually, and cells share whole faces."""

    lower: Point | None = Field(None, description="corner of a box with the smallest coordinates")
    upper: Point | None = Field(None, description="corner of a box with the largest coordinates")
    around: tuple[Name, ...] = Field(
        (),
        description="around which bodies cells are finer, instead of a box: names of solids, blocks, groups or parts "
        'at their initial positions, or "solids", "blocks" and "terrain" for all of a kind',
        examples=[["pier", "house"]],
    )
    margin: PositiveLength | None = Field(
        None,
        description="how far around: from the faces of bodies, and up from the ground; twice as far they are finer by "
        "one level less, and so on; absent: twice the size of the finest cells",
    )
    between: tuple[Length, Length] | None = Field(
        None, description='with around = ["terrain"]: only where the ground lies between these levels z'
    )
    levels: int = Field(
        1, ge=1, le=6, strict=True, description="how often cells are halved: 1, 2, 3: half, quarter, eighth"
    )


class Tank(Section):
    """Domain of the water: a fixed mesh of tetrahedra, of a box (lower, upper, cell) or from a file (mesh). Closed
    sides are walls for blocks too."""

    lower: Point | None = Field(
        None, description="corner with the smallest coordinates; needed without mesh", examples=[[0, 0, 0]]
    )
    upper: Point | None = Field(
        None, description="corner with the largest coordinates; needed without mesh", examples=[[60, 24, 16]]
    )
    cell: PositiveLength | None = Field(
        None,
        description="wanted edge of the bricks that the box is divided into, six tetrahedral cells each; needed "
        "without mesh; changed so that a whole number fits each side",
        examples=["1 m"],
    )
    split: Literal["kuhn", "mirrored"] = Field(
        "kuhn",
        description="how bricks become cells: all along the same diagonal, or each as the mirror image of those beside "
        "it, so that a flow that divides at an obstacle stays symmetric",
    )
    mesh: Annotated[str, Field(min_length=1)] | None = Field(
        None,
        description="a file of tetrahedra in any format that meshio reads (MSH, VTU, VTK, ...), from the directory of "
        "the case, instead of lower, upper, cell and split; its whole boundary is wall but for the flat ends along the "
        "axes that open, smooth, an inflow or a sea name. Water alone may have a basin of any shape; blocks need a bed "
        "that is a height over every place, up to 3 to 1 steep, and steeper walls that are flat and bound the whole "
        "basin, as those of a round tank. They are not joined to an uneven bed: they lie on it",
        examples=["basin.msh"],
    )
    scale: PositiveLength = Field(1.0, description="length of one unit of mesh", examples=["1 mm"])
    offset: Point = Field((0.0, 0.0, 0.0), description="added to all places of mesh, after the scale")
    stretch: tuple[Stretch, ...] = Field(
        (),
        description="parts of an axis with shorter or longer bricks; not with mesh, along z not with [terrain]",
    )
    refine: tuple[Refine, ...] = Field(
        (), description="parts of the tank with finer cells; with mesh and [terrain] too"
    )
    open: tuple[Side, ...] = Field(
        ("z+",), description="sides through which air and water may leave; the others are walls"
    )
    smooth: tuple[Side, ...] = Field(
        (),
        description="closed sides along which water slips whatever water.walls is, for instance the symmetry planes "
        "of a slice; blocks rub on them unless a contact.pair with tank has friction = 0",
    )

    _ground: object = PrivateAttr(None)
    _regions: object = PrivateAttr(None)

    @property
    def ground(self) -> Any:
        """Height map that the mesh ends on, of a case with [terrain]; None without."""
        return self._ground

    @property
    def is_box(self) -> bool:
        """Whether its water may be everywhere between lower and upper."""
        return self.mesh is None and self._ground is None

    @property
    def regions(self) -> Any:
        """`geometry.tank_regions.Regions` that the tables of `refine` stand for; None without any."""
        return self._regions

    def with_regions(self, regions: Any) -> Tank:
        """The same tank with these regions."""
        other = self.model_copy()
        other._regions = regions
        return other

    def standing_on(self, ground: Any) -> Tank:
        """The same tank over a height map."""
        other = self.model_copy()
        other._ground = ground
        return other


def _checked_uplift(section: Any) -> Any:
    """A share where uplift = "share", and nowhere else."""
    if (section.uplift == "share") != (section.uplift_share is not None):
        raise ValueError(
            'uplift = "share" and uplift_share (a number from 0 to 1) go together; give both or neither'
        )
    return section


class ContactPair(Section):
    """Friction and uplift between two materials that differ from the rest."""

    materials: tuple[Name, Name] = Field(
        description="materials of blocks, of the ground (ground) or of tank sides (tank)",
        examples=[["brick", "ground"]],
    )
    friction: Annotated[float, InSI("", ge=0)] | None = Field(
        None, description="mu of this pair; absent: that of [contact]"
    )
    uplift: Literal["full", "none", "share"] | None = Field(
        None, description="as in [contact]; absent: what is given there"
    )
    uplift_share: Annotated[float, InSI("", ge=0, le=1)] | None = Field(
        None, description="needed with uplift = share"
    )

    @model_validator(mode="after")
    def _share_is_known(self) -> Self:
        return _checked_uplift(self)


class Contact(Section):
    """Spring, dashpot and friction between touching faces."""

    stiffness: Annotated[float, InSI("N/m", gt=0)] | None = Field(
        None,
        description="K of two faces of which the smaller lies on the other, whatever their sizes, and of a face on "
        "the ground; absent: the closing stiffness of the joints, so that a face whose joint breaks keeps its "
        "stiffness",
        examples=["1 GN/m"],
    )
    restitution: Annotated[float, InSI("", gt=0, le=1)] = Field(
        0.3,
        description="e, velocity after a normal impact over the velocity before; 0 would need an infinite dashpot: for "
        "blows without a rebound take 0.05, whose substep is 0.4 times that of 0.3",
    )
    friction: Annotated[float, InSI("", ge=0)] = Field(
        0.5, description="mu, largest tangential over normal force; presets of materials bring their own"
    )
    shear_ratio: Annotated[float, InSI("", gt=0, le=10)] = Field(
        1.0, description="tangential over normal stiffness, K_t/K_n"
    )
    tangential_restitution: Annotated[float, InSI("", gt=0, le=1)] | None = Field(
        None,
        description="coefficient of restitution along the face; absent: the tangential dashpot is in proportion to "
        "the stiffness",
    )
    rule: Literal["exact", "paper"] = Field(
        "exact",
        description="dashpot that gives e exactly without tension, or the closed formula of the published method",
    )
    nodes_per_edge: Annotated[int, Field(strict=True, ge=3, le=33)] = Field(
        3,
        description="contact nodes along an edge of a block; contact of crossing edges does not depend on it",
    )
    uplift: Literal["full", "none", "share"] = Field(
        "full",
        description="pressure of the water between faces that touch at the start without a joint, as long as they are "
        "in contact with one another, with the ground or with the floor of the tank: that of the water around them, "
        "none (the faces keep the water out), or uplift_share of it",
    )
    uplift_share: Annotated[float, InSI("", ge=0, le=1)] | None = Field(
        None, description="share of the pressure around that acts, needed with uplift = share", examples=[0.5]
    )
    pair: tuple[ContactPair, ...] = Field(
        (), description="pairs of materials with friction or uplift of their own"
    )

    @model_validator(mode="after")
    def _share_is_known(self) -> Self:
        return _checked_uplift(self)


class JointPair(Section):
    """Joints between chosen blocks that differ from the rest, or none; of several that fit, the last is used."""

    between: tuple[Name, Name] = Field(
        description="two names: of tables of the structure (a building, a wall, a town, ...), blocks, groups or "
        "materials, ground (the ground) or tank (its floor)",
        examples=[["wall", "ground"]],
    )
    joined: Switch = Field(True, description="false: no joint")
    strength: Annotated[float, InSI("Pa", gt=0)] | None = Field(
        None, description="absent, like all below: that of [joints]"
    )
    opening_at_failure: PositiveLength | None = Field(
        None, description="opening at which the traction is zero"
    )
    law: Name | None = Field(
        None, description="as in [joints]; with a law of its own, the default of peak is that of the law"
    )
    peak: Annotated[float, InSI("", gt=0, lt=1)] | None = Field(
        None, description="opening at T_max over opening_at_failure"
    )
    mixed_mode: Literal["effective", "needleman"] | None = Field(None, description="as in [joints]")
    shear_ratio: Annotated[float, InSI("", gt=0)] | None = Field(None, description="beta")
    closing_ratio: Annotated[float, InSI("", gt=0)] | None = Field(
        None, description="stiffness in compression over the first in tension"
    )
    uplift: Literal["none", "damage", "full"] | None = Field(None, description="as in [joints]")


class Joints(Section):
    """Cohesion between touching faces, by default T = 27/4 T_max d (1 - d)^2, d = opening/opening_at_failure."""

    strength: Annotated[float, InSI("Pa", gt=0)] | None = Field(
        None,
        description="T_max, largest traction; needed unless the material of every block is a preset, such as "
        '"brick-masonry" (`explain concrete`), or every joint of another material has its [[joints.pair]]',
        examples=["0.5 MPa"],
    )
    opening_at_failure: PositiveLength | None = Field(
        None, description="opening at which the traction is zero; needed as strength is", examples=["5 mm"]
    )
    law: Name = Field(
        "polynomial",
        description="polynomial, bilinear, exponential, or the name of another file in yade_scripts/joints/laws",
    )
    peak: Annotated[float, InSI("", gt=0, lt=1)] | None = Field(
        None,
        description="opening at T_max over opening_at_failure; absent: 1/3 polynomial (fixed), 0.1 bilinear "
        "(0.01 to 0.9) and exponential (0.01 to 0.2)",
    )
    mixed_mode: Literal["effective", "needleman"] = Field(
        "effective",
        description="effective: one history for opening and sliding; needleman: potential of Needleman (1987), "
        "polynomial law only, shear does not soften without opening",
    )
    shear_ratio: Annotated[float, InSI("", gt=0)] = Field(
        1.0,
        description="beta, weight of sliding in the effective opening and in the shear traction; needleman: "
        "square root of alpha",
    )
    closing_ratio: Annotated[float, InSI("", gt=0)] = Field(
        1.0, description="stiffness in compression over the first stiffness in tension"
    )
    damping: Annotated[float, InSI("", ge=0, lt=1)] = Field(
        0.02, description="share of critical damping, proportional to the stiffness of the joint"
    )
    uplift: Literal["none", "damage", "full"] = Field(
        "none",
        description="pressure of the surrounding water between joined faces at least two cells wide: none, the joint "
        "keeps water out until it has failed; damage, a share that rises at each place from none at the largest "
        "traction to all at failure; full, all of it from the start. After failure it is full in each case",
    )
    points: Literal["auto"] | Annotated[int, Field(strict=True, ge=2, le=12)] = Field(
        "auto",
        description="Gauss points along each direction of a joined face; auto: for a peak moment to 2 %, from 3 up "
        "with closing_ratio and the law",
    )
    ground: Switch = Field(
        True,
        description="true: blocks that stand on the ground are joined to it; a pair with the ground is used in any "
        "case",
    )
    distribution: Literal["weibull", "lognormal"] | None = Field(
        None,
        description="strengths are random, joint by joint, with strength as their mean; opening_at_failure is the "
        "same, so that stiffness and work of separation are in proportion to the strength; absent: all strengths are "
        "equal",
    )
    variation: Annotated[float, InSI("", ge=0.001, le=1)] | None = Field(
        None, description="standard deviation of the strengths over their mean, needed with distribution"
    )
    seed: Annotated[int, Field(strict=True, ge=0)] = Field(
        1, description="seed of the random strengths; the same seed gives the same strengths"
    )
    pair: tuple[JointPair, ...] = Field((), description="joints between chosen blocks")


class Motion(Section):
    """A block that moves as prescribed, without turning: the grip of a testing machine, a gate, a wave maker, a shaking
    table. It has one velocity for the whole run (velocity), or a table over time, here (times with velocities or
    displacements) or in a file (path): velocities are linear in between and the place follows from them, displacements
    lie on a smooth curve (cubic spline) that starts and ends at rest."""

    block: Name = Field(description="name of the block")
    velocity: VelocityVector | None = Field(None, description="its velocity for the whole run")
    times: tuple[Annotated[float, InSI("s", ge=0)], ...] = Field(
        (),
        description="instead: times of velocities or displacements, increasing, the first 0; after the last its "
        "velocity goes on, or it stays",
        examples=[["0 s", "0.5 s", "1 s"]],
    )
    velocities: tuple[VelocityVector, ...] = Field(
        (),
        description="velocity at each of these times, linear in between",
        examples=[[[0, 0, 0], ["0.2 m/s", 0, 0], [0, 0, 0]]],
    )
    displacements: tuple[Point, ...] = Field(
        (),
        description="instead of velocities: displacement from the place at the start at each of these times, the first "
        "zero",
        examples=[[[0, 0, 0], ["5 cm", 0, 0], [0, 0, 0]]],
    )
    path: File | None = Field(
        None,
        description="instead: CSV with the columns time [s] and velocity_x, velocity_y, velocity_z [m/s], or "
        "displacement_x, displacement_y, displacement_z [m], at least one of them (the others are zero), from the "
        "directory of the case",
        examples=["paddle.csv"],
    )


class Coupling(Section):
    """How water and blocks agree on a step."""

    passes: Annotated[int, Field(strict=True, ge=1, le=4)] = Field(
        2,
        description="most pressure solves in a step: the blocks' stiffness is in the first; with what the blocks then "
        "did, the step is taken again while the defect is above the tolerance",
    )
    tolerance: Annotated[float, InSI("", gt=0, le=1)] = Field(
        0.02, description="defect of a step above which another pass is made"
    )


class RunLimits(Section):
    """When a run stops early because its numbers are not to be trusted, or have cost enough."""

    volume_error: Annotated[float, InSI("", gt=0)] = Field(
        0.02, description="lost or gained share of the water"
    )
    energy_error: Annotated[float, InSI("", gt=0)] = Field(
        0.05, description="unbalanced share of the energy put in"
    )
    momentum_error: Annotated[float, InSI("", gt=0)] = Field(
        1e-8, description="share of the impulses of a step by which the balance of momentum misses"
    )
    defect: Annotated[float, InSI("", gt=0)] = Field(
        0.5,
        description="share by which the blocks may miss the motion that the pressure solve assumed, on the mean of "
        "the last twenty steps; a single step that misses by more than 0.6 of it is halved and taken again",
    )
    overlap: Annotated[float, InSI("", gt=0)] = Field(
        0.25,
        description="depth to which a block may be in another, the ground or a side of the tank, over the thickness "
        "of the thinner one: twice the distance of its nearest face from its centre of mass",
    )
    air_pressure: Annotated[float, InSI("Pa", gt=0)] = Field(
        1e6, description="pressure of trapped air, relative to the open air"
    )
    cpu_seconds: PositiveTime | None = Field(
        None, description="processor time that the run may take; a resumed run has as much again"
    )


class Case(Section):
    """A whole case file."""

    case: About = Field(description="title, description and gravity")
    time: Time = Field(description="duration, steps and output times")
    tank: Tank | None = Field(None, description="domain of the water: a box, or a mesh from a file")
    terrain: Terrain | None = Field(
        None, description="the ground from a file: bed of the water, and dry land"
    )
    water: Water | None = Field(None, description="the water")
    solid: tuple[Solid, ...] = Field((), description="fixed bodies in the water")
    structure: Structure | None = Field(None, description="rigid blocks")
    contact: Contact | None = Field(None, description="contact law of touching blocks")
    joints: Joints | None = Field(None, description="cohesive joints between touching faces, which may break")
    gauge: tuple[Gauge, ...] = Field((), description="quantities measured at every step")
    motion: tuple[Motion, ...] = Field((), description="blocks with a prescribed motion")
    coupling: Coupling = Field(
        default_factory=Coupling, description="iteration between water and blocks in a step"
    )
    limits: RunLimits = Field(default_factory=RunLimits, description="limits at which a run stops early")
    verdict: Verdict = Field(
        default_factory=Verdict, description="criteria by which a structure is damaged or collapsed"
    )
    study: Study | None = Field(None, exclude=True, description="what `surgebreak study` varies and measures")
    sweep: Sweep | None = Field(None, exclude=True, description="what `surgebreak sweep` varies and measures")


def modules(case: Case) -> dict[str, bool]:
    """Which parts of the program a case switches on, by name, in the order in which they are listed."""
    structure = case.structure is not None
    w, water = case.water, case.water is not None
    return {
        "terrain": case.terrain is not None,
        "water": water,
        "stabilised transport": w is not None and w.advection == "supg",
        "viscosity": w is not None and w.viscosity > 0.0,
        "wall friction": w is not None and w.walls == "friction",
        "trapped air": w is not None and w.air.model == "trapped",
        "inflow": w is not None and bool(w.inflow or w.sea),
        "structure": structure,
        "coupling": water and structure,
        "fixed solids": bool(case.solid),
        "contact": case.contact is not None,
        "joints": case.joints is not None,
        "prescribed motion": bool(case.motion),
        "gauges": bool(case.gauge),
    }


def effective(case: Case) -> dict:
    """The case with every default filled in, as plain data in SI; `Case.model_validate` reads it back."""
    return case.model_dump(mode="json", exclude_none=True)
