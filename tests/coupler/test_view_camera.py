"""Framing works for any case, and the colour scales are what they claim to be."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coupler.commands.view import palette
from coupler.commands.view.camera import SIDES, VIEWS, angle_of, frame, side_of

MARGIN = (0.04, 0.1, 0.17, 0.05)


def on_picture(camera, points, aspect):
    """Places (k, 2) of points on the picture, 0 … 1 from left to right and from bottom to top."""
    back = camera.position - camera.focus
    back /= np.linalg.norm(back)
    right = np.cross(camera.up, back)
    seen = points - camera.position
    depth = -(seen @ back)
    half = np.tan(np.radians(camera.view_angle) / 2) * depth
    return np.stack([0.5 + seen @ right / (2 * half * aspect), 0.5 + seen @ camera.up / (2 * half)], axis=1)


@given(
    lower=st.tuples(*[st.floats(-1e3, 1e3)] * 3),
    size=st.tuples(*[st.floats(0.05, 200.0)] * 3),
    azimuth=st.floats(-180, 180),
    elevation=st.floats(-5, 85),
    aspect=st.floats(0.5, 3.0),
)
@settings(max_examples=100, deadline=None)
def test_every_corner_is_inside_the_margins_and_the_box_fills_them(lower, size, azimuth, elevation, aspect):
    """Inside: nothing is cut off. Touching two opposite margins: no camera in that direction could be nearer."""
    lower = np.array(lower)
    camera = frame(lower, lower + size, aspect, azimuth, elevation, margin=MARGIN)
    corners = np.array(list(itertools.product(*zip(lower, lower + size))))
    place = on_picture(camera, corners, aspect)
    low, high = np.array([MARGIN[0], MARGIN[2]]), 1 - np.array([MARGIN[1], MARGIN[3]])
    assert np.all(place >= low - 1e-6)
    assert np.all(place <= high + 1e-6)
    touching = (place.min(axis=0) < low + 1e-6) & (place.max(axis=0) > high - 1e-6)
    assert touching.any()


@pytest.mark.parametrize("ends", [palette.WATER_ENDS, palette.DAMAGE_ENDS])
def test_lightness_falls_evenly_along_a_scale(ends):
    """Equal steps of the value are equal steps of L*, also after sRGB; a clipped colour would bend the line."""
    colours = palette.scale(ends, 65)
    linear = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    luminance = linear @ np.array([0.2126729, 0.7151522, 0.0721750])  # IEC 61966-2-1
    lightness = 116 * np.cbrt(luminance) - 16
    np.testing.assert_allclose(lightness, np.linspace(ends[0][0], ends[1][0], 65), atol=0.1)


@pytest.mark.parametrize(
    ("where", "azimuth"), [((1, -1), -62.0), ((-1, -1), -118.0), ((-1, 1), 118.0), ((1, 1), 62.0)]
)
def test_the_camera_stands_on_the_side_where_things_happen(where, azimuth):
    assert side_of(np.array(where, float)) == azimuth


def test_without_a_side_the_camera_stands_where_it_always_did():
    assert side_of(np.zeros(2)) == SIDES[0]
    assert side_of(np.array([0.0, -1.0])) == SIDES[0]  # two are as good


def test_a_plan_has_x_to_the_right_and_y_upwards():
    camera = frame([0, 0, 0], [4, 2, 1], 1.5, *VIEWS["plan"])
    np.testing.assert_allclose(camera.up, [0, 1, 0], atol=1e-9)
    assert camera.position[2] > 1.0
    np.testing.assert_allclose(camera.position[:2], [2, 1], atol=1e-6)


@pytest.mark.parametrize("view", VIEWS.values())
def test_a_view_by_name_has_one_scale_at_every_depth(view):
    """Else the scale bar of a plan holds for the ground alone, and roofs are drawn larger and over what stands beside
    them. Ends of the near and of the far side of the box lie apart by the same share of the picture within 2 %."""
    lower, upper = np.zeros(3), np.array([4.0, 2.0, 1.0])
    camera = frame(lower, upper, 1.5, *view, angle_of(*view))
    back = camera.position - camera.focus
    deep = int(np.argmax(np.abs(back)))
    widths = []
    for depth in (lower[deep], upper[deep]):
        ends = np.array([lower, upper])
        ends[:, deep] = depth
        widths.append(np.abs(np.diff(on_picture(camera, ends, 1.5), axis=0)).max())
    height = np.linalg.norm(back) * 2 * np.tan(np.radians(camera.view_angle) / 2)
    assert abs(widths[0] / widths[1] - 1.0) < 0.02 * max(1.0, (upper - lower)[deep] / height)


def test_other_directions_keep_their_perspective():
    assert angle_of(-65.0, 24.0) > 20.0
