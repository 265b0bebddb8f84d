"""Cost of a step of the water by stage: a dam break over a box in a tank of any size (`part.py water NODES`).

Times are CPU seconds of this process, the mean over STEPS steps while the water runs through the tank.
"""

from __future__ import annotations

import importlib
import time

import numpy as np

STEPS = 8
BEFORE = 0.35
"""Seconds of the dam break before the steps that are measured."""
STAGES = {
    "transport": (("step.predictor", "carried"),),
    "distance": (("step.predictor", "redistance"),),
    "volume": (
        ("transport.surface_momentum", "carry_volume"),
        ("transport.surface_momentum", "_jumps"),
        ("transport.surface_momentum", "pass_on"),
        ("step.predictor", "correct_volume"),
        ("surface.volume", "edge_flux"),
    ),
    "pressure matrix": (("step.predictor", "_problem"),),
    "solver, set-up": (("numerics.solve", "Multigrid"),),
    "solver, iterations": (("numerics.bounded", "solve_bounded"),),
    "correction": (
        ("step.corrector", "_projected"),
        ("step.corrector", "left_in_cells"),
        ("step.corrector", "_limit_and_damp"),
    ),
    "continuation": (("step.corrector", "extend_velocity"),),
    "accounts": (("step.corrector", "momentum_change"), ("step.corrector", "_report")),
}
"""Stage → functions of `fluid` that it consists of, without what they call of another stage."""


class Stages:
    """CPU seconds by stage, while the functions of STAGES are replaced by timed ones."""

    def __init__(self):
        self.seconds = dict.fromkeys(STAGES, 0.0)
        self._replaced = []
        self._within = [0.0]
        """Seconds that other stages took within each of the active calls."""

    def __enter__(self) -> Stages:
        for stage, functions in STAGES.items():
            for room, name in functions:
                module = importlib.import_module(f"fluid.{room}")
                function = getattr(module, name)
                self._replaced.append((module, name, function))
                setattr(module, name, self._timed(stage, function))
        return self

    def __exit__(self, *_) -> None:
        for module, name, function in self._replaced:
            setattr(module, name, function)

    def _timed(self, stage: str, function):
        def timed(*args, **kwargs):
            began = time.process_time()
            self._within.append(0.0)
            result = function(*args, **kwargs)
            spent = time.process_time() - began
            self.seconds[stage] += spent - self._within.pop()
            self._within[-1] += spent
            return result

        return timed


def dam_break(nodes: int, height: float = 1.0):
    """Water of the geometry of SPHERIC benchmark 2 in a tank with about so many nodes where it is 1 m high."""
    from fluid.cut.bodies import ConvexBodies
    from fluid.domain.physical_domain import cut_domain
    from fluid.mesh.background import box_mesh
    from fluid.step.water import Water

    cell = (3.22 / nodes) ** (1.0 / 3.0)
    mesh = box_mesh((0.0, 0.0, 0.0), (3.22, 1.0, height), cell)
    box = ConvexBodies.boxes([[2.476, 0.5, 0.0805]], [[0.161, 0.403, 0.161]])
    return Water(mesh, cut_domain(mesh, box), lambda x: np.maximum(x[:, 0] - 1.228, x[:, 2] - 0.55))


def step(water) -> int:
    """One step of the water alone; the iterations of its pressure."""
    from fluid.numerics.bounded import solve_pressure

    problem = water.predict(water.stable_step())
    found = solve_pressure(problem, 1e-8)
    water.correct(problem, found.x, found.parting)
    return found.iterations


def water(nodes: int, height: float = 1.0) -> dict:
    """Seconds of a step, in all and by stage, and the size of the scene."""
    scene = dam_break(nodes, height)
    while scene.time < BEFORE:
        step(scene)
    iterations = 0
    with Stages() as stages:
        began = time.process_time()
        for _ in range(STEPS):
            iterations += step(scene)
        spent = time.process_time() - began
    by_stage = {name: seconds / STEPS for name, seconds in stages.seconds.items()}
    return {
        "nodes": len(scene.mesh.nodes),
        "cells": len(scene.mesh.cells),
        "unknowns": scene.report.unknowns,
        "iterations": iterations / STEPS,
        "step": spent / STEPS,
        "stages": by_stage,
        "rest": spent / STEPS - sum(by_stage.values()),
    }


def taller_tank(nodes: int) -> dict:
    """The same water in a tank twice as high, which gives the cost of dry cells."""
    return {"low": water(nodes), "high": water(nodes, 2.0)}
