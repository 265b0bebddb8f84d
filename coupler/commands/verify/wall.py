"""A wall of glued courses with still water on one side, against the strength of its base joint.

ρ g b h³/6 = T_max b t² m_max(n, kc/K0): the moment of the water against what the joint carries under the weight above.
Depths for a wall 2 m high, 0.2 m thick, 2000 kg/m³, T_max 0.1 MPa: the table of m_max solved for h.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator

from coupler.case.case import Case
from coupler.commands.verify.figures import columns
from coupler.commands.verify.registry import Finding, check
from coupler.run.clock import Clock
from coupler.scene.build import build
from fluid.numerics.bounded import solve_pressure
from yade_scripts.dynamics.equilibrium import CannotStand, settle

HEIGHT, THICKNESS, STRENGTH, DENSITY = 2.0, 0.2, 1e5, 2000.0
SLICE, FACE = 0.5, 1.1
OVERHANG = 0.001
"""The wall reaches beyond the tank, so that its sides neither hold it nor let water past."""
G, RHO = 9.81, 1000.0


def exact_depth(ratio: float) -> float:
    """Depth [m] of still water that breaks the base joint."""
    table = columns("coh_joint_Mmax_vs_N")
    own = table["kc_over_K0"] == ratio
    n = DENSITY * G * HEIGHT / STRENGTH
    moment = STRENGTH * THICKNESS**2 * float(PchipInterpolator(table["n"][own], table["mmax"][own])(n))
    return (6.0 * moment / (RHO * G)) ** (1.0 / 3.0)


def wall(depth: float, ratio: float = 1.0, start: str = "settled", opening: float = 2e-4):
    """The coupled scene from a case; raises CannotStand where a settled start finds no equilibrium."""
    course = [THICKNESS, SLICE + 2 * OVERHANG, 0.25]
    case = Case.model_validate(
        {
            "case": {"title": "wall under still water"},
            "time": {"end": 1.0, "step_max": 0.01},
            "tank": {"lower": [0, 0, 0], "upper": [2.5, SLICE, 2.5], "cell": 0.25, "open": ["z+"]},
            "water": {"covers": "multiple", "fill": [{"lower": [0, 0, 0], "upper": [FACE, SLICE, depth]}]},
            "structure": {
                "density": DENSITY,
                "start": start,
                "ground": {"level": 0.0},
                "wall": [
                    {
                        "name": "wall",
                        "lower": [FACE, -OVERHANG, 0],
                        "size": [*course[:2], HEIGHT],
                        "block": course,
                    }
                ],
            },
            "joints": {
                "strength": STRENGTH,
                "opening_at_failure": opening,
                "closing_ratio": ratio,
                "damping": 0.02,
            },
        }
    )
    return build(case, Clock()).coupling


@check("P57", "cohesive wall under still water", "strength of the base joint under axial load")
def wall_under_still_water():
    for ratio in (1.0, 10.0, 100.0):
        what = f"depth that breaks the base joint [m], kc/K0 {ratio:g}"
        yield Finding(what, _critical_depth(ratio), exact_depth(ratio), 0.03)
    depth = exact_depth(1.0)
    stands = wall(0.93 * depth)
    _run(stands, 0.3)
    yield Finding("joints alive after 0.3 s at 0.93 of it", _alive(stands), 1.0, 0.0)
    stands.structure.close()
    falls = wall(1.07 * depth, start="sudden", opening=1e-3)
    _run(falls, 0.6)
    damage = float(falls.structure.joint_table().damage.max())
    yield Finding("largest damage after 0.6 s at 1.07 of it", damage, 1.0, 1e-3)
    falls.structure.close()


def _critical_depth(ratio: float) -> float:
    """Largest depth [m] at which a start at rest finds an equilibrium, by bisection."""
    low, high = 0.5, 1.5
    while high - low > 0.005:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _stands(middle, ratio) else (low, middle)
    return 0.5 * (low + high)


def _stands(depth: float, ratio: float) -> bool:
    coupling = wall(depth, ratio, start="sudden")
    structure = coupling.structure
    try:
        settle(structure, _load_at_rest(coupling.water)[: structure.n])
    except CannotStand:
        return False
    finally:
        structure.close()
    return True


def _load_at_rest(water) -> np.ndarray:
    """Force and moment (n, 6) of still water on the blocks while they are held."""
    problem = water.predict(water.stable_step())
    x = solve_pressure(problem, 1e-10).x
    return problem.with_waterline_of(x).load(x)


def _run(coupling, end: float) -> None:
    while coupling.time < end * (1.0 - 1e-12):
        coupling.step(coupling.step_size(end - coupling.time))


def _alive(coupling) -> float:
    return float(np.mean(coupling.structure.joint_table().alive))
