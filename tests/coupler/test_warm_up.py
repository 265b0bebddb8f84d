"""The warm-up must touch every kernel, or the first real run compiles after all."""

from coupler.case.case import modules
from coupler.checks.read_case import load
from coupler.commands.warm_up import CASE


def test_the_warm_up_case_switches_on_both_sides_and_what_joins_them(tmp_path):
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    on = modules(load(tmp_path).case)
    rare = {
        "prescribed motion",
        "stabilised transport",
        "viscosity",
        "wall friction",
        "inflow",
    }  # these compile when they are asked for
    assert {name for name, switched in on.items() if not switched} == rare
