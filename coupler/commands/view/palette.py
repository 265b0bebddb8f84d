"""Colours: two scales whose lightness falls evenly with the value, so that they also read in grey print.

Each scale runs straight through the CIELAB space between a light and a dark colour (equal steps look equally large).
Water is blue and blocks are sand to red: the pair can be distinguished with any common colour blindness.
"""

import numpy as np

PAPER = "#ffffff"
INK = "#222222"
GROUND = "#efedea"
BED = "#aeb59a"
SHADOW = "#c9c5bf"
SOLID = "#9a9a9a"
TANK = "#8a8f96"
WATER_ENDS = ((80.0, -16.0, -22.0), (25.0, 18.0, -48.0))  # L*, a*, b*
DAMAGE_ENDS = ((86.0, 3.0, 18.0), (34.0, 52.0, 36.0))
# Okabe & Ito (2008), safe for colour-blind readers; the yellow is left out: too pale for a line on white.
LINES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#000000")
POCKETS = ("#009e73", "#e69f00", "#cc79a7", "#d55e00", "#8a2be2")
"""Colours of pockets of trapped air by number, repeated cyclically; none is among the blues of the water."""

_WHITE = np.array([0.95047, 1.0, 1.08883])  # D65
_TO_RGB = np.array(
    [
        [3.2404542, -1.5371385, -0.4985314],
        [-0.9692660, 1.8760108, 0.0415560],
        [0.0556434, -0.2040259, 1.0572252],
    ]
)


def scale(ends, count=256):
    """Colours (count, 3) in [0, 1] from the first to the second of two CIELAB colours."""
    first, last = np.asarray(ends, dtype=float)
    return rgb(first + np.linspace(0, 1, count)[:, None] * (last - first))


def rgb(lab):
    """sRGB (n, 3) of CIELAB (n, 3) under D65 (CIE 15, IEC 61966-2-1), clipped to what a screen shows."""
    light = (lab[:, 0] + 16) / 116
    f = np.stack([light + lab[:, 1] / 500, light, light - lab[:, 2] / 200], axis=1)
    xyz = _WHITE * np.where(f > 6 / 29, f**3, 3 * (6 / 29) ** 2 * (f - 4 / 29))
    linear = np.clip(xyz @ _TO_RGB.T, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
