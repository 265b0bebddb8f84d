"""Observed order of convergence p of an error e = C h^p, from runs with sizes h.

Against an exact answer: least squares of log e over log h, and of the last two runs alone. Without one (the finest
run or a measurement is no limit of the scheme): from the three finest values f1, f2, f3 with sizes h1 > h2 > h3,

    (f1 - f2)/(f2 - f3) = (h1^p - h2^p)/(h2^p - h3^p)        (Roache, J. Fluids Eng. 116 (1994) 405)
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

ORDERS = (0.05, 4.0)
"""Interval in which p is sought: twice the highest order of the schemes. Beyond it the second of three values lies
near the third by chance: with sizes of 75, 60 and 50 mm such a p was 9.9."""
ROUND_OFF = 1e-9
"""Errors below this are round-off and are not used for the order."""


def slope(size, error) -> float:
    """Least-squares slope of log e over log h; NaN with fewer than two runs that have an error."""
    size, error = np.asarray(size, float), np.asarray(error, float)
    there = np.isfinite(error) & (error > ROUND_OFF)
    if len(np.unique(size[there])) < 2:
        return float("nan")
    return float(np.polyfit(np.log(size[there]), np.log(error[there]), 1)[0])


def last_slope(size, error) -> float:
    """Slope of the two finest runs."""
    fine = np.argsort(size)[:2]
    return slope(np.asarray(size, float)[fine], np.asarray(error, float)[fine])


def three_run_order(size, value) -> float:
    """p from the three finest values; NaN where they do not approach a limit one after the other."""
    size, value = np.asarray(size, float), np.asarray(value, float)
    if len(size) < 3:
        return float("nan")
    fine = np.argsort(size)[:3][::-1]
    h1, h2, h3 = size[fine]
    f1, f2, f3 = value[fine]
    if f2 == f3 or h1 == h2 or h2 == h3 or not (f1 - f2) / (f2 - f3) > 0.0:
        return float("nan")
    wanted = (f1 - f2) / (f2 - f3)

    def miss(p: float) -> float:
        return (h1**p - h2**p) / (h2**p - h3**p) - wanted

    low, high = ORDERS
    return float(brentq(miss, low, high)) if miss(low) * miss(high) < 0.0 else float("nan")
