"""Computed curves beside measured or exact ones: the content of a figure.

A case yields `Figure`s between its findings. They are drawn where `surgebreak verify --plots DIR` asks for them, and
cost nothing otherwise. They are written as JSON, because pictures are made in a process of their own
(coupler/commands/view/curves.py).
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np

Kind = Literal["computed", "other", "measured", "band", "exact"]
"""computed here · by another program or setting · measured points · measured range (with `upper`) · closed form."""


@dataclass(frozen=True)
class Curve:
    """A line or points: x, y (n,) in the units of its panel; a band reaches from y to upper (n,). No label: not in the
    legend. points: single results, which no line may join."""

    label: str
    kind: Kind
    x: np.ndarray
    y: np.ndarray
    upper: np.ndarray | None = None
    points: bool = False


@dataclass(frozen=True)
class Panel:
    """Curves over one pair of axes; their names carry the units. x_range, y_range: what is shown, None: all.
    log: the logarithmic axes, "", "x", "y" or "xy"."""

    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    x_range: tuple[float, float] | None = None
    y_range: tuple[float, float] | None = None
    log: str = ""


@dataclass(frozen=True)
class Figure:
    """name: of the file · panels in `columns` columns."""

    name: str
    panels: tuple[Panel, ...]
    columns: int = 1


def as_json(figure: Figure) -> dict:
    """What json can write: arrays become lists."""
    return _plain(asdict(figure))


def _plain(value):
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    if isinstance(value, np.ndarray):
        return [float(entry) for entry in value]
    return value
