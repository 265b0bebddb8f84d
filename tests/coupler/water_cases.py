"""Cases of water in a small tank for tests: as a case, what its checks report, and run to an end."""

from coupler.case.case import Case
from coupler.checks.case import problems
from coupler.scene.build import build
from tests.fakes import no_clock

TANK = {"lower": [0, 0, 0], "upper": [2, 0.2, 1], "cell": 0.1, "smooth": ["y-", "y+"]}
FILL = [{"lower": [0, 0, 0], "upper": [2, 0.2, 0.5]}]


def case(water=None, **more):
    sections = {
        "case": {"title": "t"},
        "time": {"end": 1.0},
        "tank": TANK,
        "water": {"fill": FILL} | (water or {}),
    }
    return Case.model_validate(sections | more)


def reported(*args, **kwargs):
    return [f"{'.'.join(map(str, path))}: {text}" for path, text in problems(case(*args, **kwargs))]


def run(found, end):
    coupling, rows = build(found, no_clock), []
    while coupling.coupling.time < end - 1e-9:
        record = coupling.coupling.step(coupling.coupling.step_size(end - coupling.coupling.time))
        rows.append({k: v for g in coupling.gauges for k, v in g.read(coupling.coupling, record).items()})
    return coupling.coupling, record, rows
