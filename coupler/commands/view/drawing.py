"""python -m coupler.commands.view.drawing FILE.npz PICTURE: blocks of a drawing, pulled apart a little; or where it
cannot be cut, red lines on its surface.

FILE.npz holds triangles (t, 3, 3) [m], part (t,) their colour, names of the parts, edges (e, 2, 3) [m] of blocks,
lines (k, 2, 3) [m] of trouble, and the size (3,) [m] that is told below the picture.
"""

import os
import sys
from pathlib import Path

os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")

import numpy as np
import pyvista as pv
from PIL import Image, ImageChops, ImageDraw, ImageFont

from coupler.commands.view import palette
from coupler.commands.view.camera import frame
from coupler.commands.view.scene import LETTERS

SIZE = (1600, 1000)
TINTS = ("#d9c7a8", "#c98f7a", "#a9c5a0", "#cdb4d6", "#e0c060", "#8e7f76")
"""Colours of parts in the order of their names, repeated cyclically; none is blue, which is the water's."""
KNOWN = {"water": "#56a0d3", "ground": palette.BED, "solid": palette.SOLID}
"""Colours of parts that are no blocks."""
TROUBLE = "#b3261e"
MARGIN, TEXT = 30, 26
"""[pixels] of paper around the content, and of the height of letters."""


def draw(place, picture):
    """Draw the content of a .npz file."""
    with np.load(place) as file:
        triangles, part, names = file["triangles"], file["part"], [str(n) for n in file["names"]]
        edges, lines, size = file["edges"], file["lines"], file["size"]
    plotter = pv.Plotter(off_screen=True, window_size=SIZE, lighting="light kit")
    plotter.set_background(palette.PAPER)
    of_blocks = [name for name in names if name not in KNOWN]
    for k, name in enumerate(names):
        own = triangles[part == k]
        if len(own):
            mesh = pv.PolyData.from_regular_faces(own.reshape(-1, 3), np.arange(3 * len(own)).reshape(-1, 3))
            wet = name == "water"
            faint = 0.35 if len(lines) or wet else 1.0
            plotter.add_mesh(mesh, color=_tint(name, of_blocks), ambient=0.25, opacity=faint)
    for ends, colour, width in ((edges, "#5b4a3a", 1.5), (lines, TROUBLE, 8)):
        if len(ends):
            plotter.add_mesh(
                pv.line_segments_from_points(ends.reshape(-1, 3)), color=colour, line_width=width
            )
    shown = np.concatenate([triangles.reshape(-1, 3), edges.reshape(-1, 3)])
    low, high = shown.min(axis=0), shown.max(axis=0)
    middle = lines.reshape(-1, 3).mean(axis=0) if len(lines) else low
    azimuth = -60.0 if middle[1] <= 0.5 * (low + high)[1] else 60.0
    view = frame(low, high, SIZE[0] / SIZE[1], azimuth, 30.0, margin=(0.04, 0.18, 0.05, 0.05))
    camera = plotter.camera
    camera.position, camera.focal_point, camera.up = view.position, view.focus, view.up
    camera.view_angle = view.view_angle
    if len(lines):
        plotter.add_text("red: where it cannot be cut", font_size=14, color=TROUBLE, font_file=str(LETTERS))
    plotter.enable_anti_aliasing("ssaa")
    plotter.reset_camera_clipping_range()
    image = cropped(Image.fromarray(plotter.screenshot(return_img=True)))
    plotter.close()
    extent = " x ".join(f"{length:.3g}" for length in size)
    tints = {name: _tint(name, of_blocks) for name in names}
    with_legend(image, tints, f"{extent} m along x, y and z").save(picture, optimize=True)


def _tint(name, of_blocks):
    return KNOWN.get(name) or TINTS[of_blocks.index(name) % len(TINTS)]


def cropped(image):
    """The picture without the empty paper around its content."""
    image = image.convert("RGB")
    box = ImageChops.difference(image, Image.new("RGB", image.size, palette.PAPER)).getbbox()
    if box is None:
        return image
    left, top, right, bottom = box
    return image.crop(
        (
            max(0, left - MARGIN),
            max(0, top - MARGIN),
            min(image.width, right + MARGIN),
            min(image.height, bottom + MARGIN),
        )
    )


def with_legend(image, tints, below):
    """The picture with the names of parts {name: colour} at its right in dark letters, and a line of text below."""
    font = ImageFont.truetype(str(LETTERS), TEXT)
    column = 3 * TEXT + max(int(font.getlength(name)) for name in tints)
    height = max(image.height, 2 * TEXT * (len(tints) + 1)) + 2 * TEXT
    page = Image.new("RGB", (image.width + column, height), palette.PAPER)
    page.paste(image, (0, 0))
    pen = ImageDraw.Draw(page)
    for k, (name, colour) in enumerate(tints.items()):
        x, y = image.width, MARGIN + 2 * TEXT * k
        pen.rectangle((x, y, x + TEXT, y + TEXT), fill=colour, outline=palette.INK)
        pen.text((x + 1.5 * TEXT, y + 0.5 * TEXT), name, fill=palette.INK, font=font, anchor="lm")
    pen.text((MARGIN, height - 1.5 * TEXT), below, fill=palette.INK, font=font, anchor="lm")
    return page


if __name__ == "__main__":
    draw(Path(sys.argv[1]), Path(sys.argv[2]))
