"""Dam breaks against walls, boxes and still water: measured records, and the bore of shallow water."""

from __future__ import annotations

import numpy as np

from coupler.verify.figures import columns, named_values
from coupler.verify.registry import Finding, check
from coupler.verify.scenes import DENSITY, G, box, column, tank
from fluid import gauges


@check("P38", "dam break on a wall, sensor 2", "Lobovsky et al., J. Fluids Struct. 48 (2014) 407", "M")
def wall_impact():
    H, n = 0.3, 16
    cell = H / n
    size = np.array([round(1.61 / cell) * cell, 2 * cell, 2 * H])
    c = tank(size, (round(size[0] / cell), 2, 2 * n), column(0.6, H), rtol=1e-7)
    scale = np.sqrt(G / H)
    sensor = np.array([size[0] - 1e-9, cell, 0.015])
    t, p = [0.0], [0.0]
    while t[-1] < 6.2:
        c.step(c.water.stable_step())
        t.append(c.time * scale)
        p.append(gauges.pressure(c.water, sensor) / (DENSITY * G * H))
    t, p = np.array(t), np.array(p)
    at = np.linspace(2.4, 6.0, 721)
    found = np.interp(at, t, p)
    table = columns("lobovsky_p2_percentiles_H300")
    low, high = (np.interp(at, table["tstar"], table[k]) for k in ("p2p5", "p97p5"))
    arrival = t[np.argmax(p > 0.1)]
    measured = table["tstar"][np.argmax((table["median"] > 0.1) & (table["tstar"] > 1.0))]
    yield Finding("arrival t* (p* = 0.1)", arrival, measured, 0.15, False)
    # the band of the repeats lies unevenly about the median: judged against its middle
    ends = np.trapezoid(low, at), np.trapezoid(high, at)
    yield Finding(
        "impulse 2.4 < t* < 6", np.trapezoid(found, at), 0.5 * sum(ends), 0.5 * (ends[1] - ends[0]), False
    )
    late = at > 3.0
    inside = np.mean((found >= low)[late] & (found <= high)[late])
    yield Finding("share of 3 < t* < 6 within the 2.5-97.5 % band", inside, 1.0, 0.2, False)


LENGTH = 3.22
"""Tank of SPHERIC test 2 [m]; x runs from the wall of the reservoir here, from the other end in the records."""


def spheric(until: float) -> dict[str, np.ndarray]:
    """Levels H1..H4 [m] and pressures P1, P3 [Pa] over time of the dam break against a box, cells of 5 cm."""
    centre = (LENGTH - 0.744, 0.5, 0.0805)
    c = tank(
        (LENGTH, 1, 1),
        (64, 20, 20),
        column(1.228, 0.55),
        solids=[box(centre, (0.161, 0.403, 0.161))],
        rtol=1e-8,
    )
    probes = {"H1": 1.488, "H2": 0.992, "H3": 0.496, "H4": 2.638}
    face = LENGTH - 0.8245
    sensors = np.array([[face, 0.5255, 0.021], [face, 0.5255, 0.101]])
    rows = []
    while c.time < until:
        c.step(c.water.stable_step())
        levels = [gauges.level(c.water, (LENGTH - x, 0.5)) for x in probes.values()]
        rows.append([c.time, *levels, *gauges.pressure(c.water, sensors)])
    return dict(zip(("t", *probes, "P1", "P3"), np.array(rows).T))


@check("P39", "SPHERIC test 2: levels", "Kleefsman et al., J. Comput. Phys. 206 (2005) 363", "M")
def levels():
    found, table = spheric(2.05), columns("kleefsman_heights_h1_h4")
    time = next(iter(table.values()))
    for probe, measured, tolerance in (("H1", 0.218, 0.05), ("H2", 0.368, 0.05), ("H3", 0.920, 0.15)):
        arrival = found["t"][np.argmax(found[probe] > 0.02)]
        yield Finding(f"arrival at {probe} [s] (level 2 cm)", arrival, measured, tolerance, False)
    until = time <= 2.0
    for number in (1, 2, 3, 4):
        measured = next(v for k, v in table.items() if k.startswith(f"H{number}"))[until]
        own = np.interp(time[until], found["t"], found[f"H{number}"])
        rms = np.sqrt(np.mean((own - measured) ** 2))
        yield Finding(f"rms difference of H{number} to 2 s [m]", rms, 0.0, 0.05, False)
    for at, measured in ((1.0, 0.279), (2.0, 0.130)):
        level = np.interp(at, found["t"], found["H4"])
        yield Finding(f"H4 at {at:g} s [m]", level, measured, 0.05, False)


@check("P40", "SPHERIC test 2: impulse of the pressure", "Kleefsman et al. 2005", "M")
def impulses():
    found, table = spheric(1.0), columns("kleefsman_pressure_p1_p3_p5_p7")
    time = next(iter(table.values()))
    within = (time >= 0.35) & (time <= 1.0)
    own = (found["t"] >= 0.35) & (found["t"] <= 1.0)
    for sensor in ("P1", "P3"):
        record = next(v for k, v in table.items() if k.startswith(sensor))
        measured = np.trapezoid(record[within], time[within])
        impulse = np.trapezoid(found[sensor][own], found["t"][own])
        yield Finding(f"impulse of {sensor} from 0.35 to 1 s [Pa s]", impulse, measured, 0.20)


@check("P41", "bore into still water (Stoker)", "shallow water theory", "M")
def bore():
    known = named_values("wave_closed_forms")
    upper, n = 0.15, 16
    cell, length = upper / n, 4.5
    for lower in (0.018, 0.038):
        speed = _bore_speed(upper, lower, cell, length)
        exact = known[f"stoker_h0={upper}_h1={lower}_bore_speed"]
        yield Finding(f"speed of the bore [m/s], {upper} m into {lower} m", speed, exact, 0.05)


def _bore_speed(upper: float, lower: float, cell: float, length: float) -> float:
    """Mean speed [m/s] of the front between 5 and 11 depths after the gate in the middle."""
    gate = 0.4 * length
    size = np.round(np.array([length, 2 * cell, 1.5 * upper]) / cell) * cell
    level = lambda x: np.minimum(np.maximum(x[:, 0] - gate, x[:, 2] - upper), x[:, 2] - lower)  # noqa: E731
    c = tank(size, np.round(size / cell).astype(int), level, rtol=1e-7)
    places = gate + upper * np.arange(5.0, 12.0)
    arrival = np.full(len(places), np.nan)
    while np.isnan(arrival[-1]) and c.time < 5.0:
        c.step(c.water.stable_step())
        now = np.array([_depth(c.water, x, cell, size[2]) for x in places])
        arrival[np.isnan(arrival) & (now > lower + 0.25 * (upper - lower))] = c.time
    return float(np.polyfit(arrival, places, 1)[0])


def _depth(water, x: float, cell: float, height: float) -> float:
    """Water [m] over the floor, mean over four cells along x: a splash ahead of the front hardly counts."""
    volume = gauges.volume_in_box(water, (x - 2 * cell, 0.0, 0.0), (x + 2 * cell, 2 * cell, height))
    return volume / (8 * cell**2)
