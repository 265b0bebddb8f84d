"""The picture of one instant: water as a volume coloured by speed, blocks by damage, solids grey, on white paper."""

import os
from pathlib import Path

# Must stand before VTK opens a window: without a display its X window only warns and falls back to EGL.
os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")

import matplotlib
import numpy as np
import pyvista as pv
from matplotlib.colors import ListedColormap

from coupler.commands.view import palette
from coupler.commands.view.camera import FAR, angle_of, frame, side_of
from coupler.commands.view.captions import caption_of, north_of, struck_side, where_it_happens
from coupler.commands.view.foam import foam
from coupler.commands.view.scales import bounds, corners, decimals, fastest_and_air, nice_floor
from coupler.commands.view.section import (
    closed_behind_cut,
    ground_behind_cut,
    solid_behind_cut,
    with_section,
)
from coupler.commands.view.water_surface import facing, shading_normals, skin, surfaces_of_pockets

WATER_OPACITY = 0.78
SUN = np.array([-0.45, -0.75, 1.1])  # from the scene to the light, for a camera at azimuth -90 degree
HEADLIGHT, LAMP = 0.3, 0.75  # from the camera, outside and where the sun does not come
FILL = np.array([1.0, -0.2, 0.25])
LETTERS = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
VTK_FONT_FILE = 4  # vtkTextProperty: use the font file
SEEN_THROUGH = 0.55
"""Opacity of blocks in a run with trapped air, which is behind them."""
MOST_POCKETS = 6
"""Largest number of pockets named in the corner of a picture, those with most surface first."""
BAR = 0.075  # height of a colour bar with its text, as a share of that of the picture


class Scene:
    """Draws the steps of a run into one window with one camera and fixed colour scales, so that pictures compare."""

    def __init__(
        self,
        run,
        size=(1280, 720),
        azimuth=None,
        elevation=22.0,
        soft=True,
        letters=1.0,
        cut=None,
        from_inside=False,
        foam=False,
    ):
        """run: RunFiles · size: (width, height) in pixels · azimuth, elevation of the camera in degrees, azimuth None:
        the side that the water strikes · cut: (axis, place [m]), None for none: what lies before it is left out ·
        soft: smooth edges, and darken corners where little light comes (three times the cost of all the rest); without
        it edges are rough, and a picture has to be drawn larger and averaged ·
        letters: times the usual size, for a picture that is shown small · from_inside: from among the blocks, towards
        the azimuth · foam: white where fast water is torn."""
        self.run, self.foam, self.soft = run, foam, soft
        eye = camera_inside(run, azimuth) if from_inside else None
        azimuth = side_of(struck_side(run)) if azimuth is None else azimuth
        self.size, self.letters = size, letters
        self.cut = None if cut is None else cut_of(cut, azimuth)
        self.lower, self.upper = bounds(run)
        self.fastest, self.traps_air = fastest_and_air(run) if run.water else (0.0, False)
        self.light, self.fill = turned(SUN, azimuth + 90.0), turned(FILL, azimuth + 90.0)
        self.caption = caption_of(run, round(CAPTION_LETTERS * size[0] / size[1] / letters))
        self.ground = ground(self.lower, self.upper, run.tank is None)
        self._pockets_drawn = 0
        self.plotter = pv.Plotter(off_screen=True, window_size=size, lighting="none")
        self.plotter.set_background(palette.PAPER)
        self._set_lights(LAMP if eye else HEADLIGHT)
        self._draw_still_parts()
        if eye is None:
            self._draw_scale_bar(azimuth)
            self._draw_north(azimuth)
        self._set_camera(azimuth, elevation, eye)
        self._smooth(soft)
        # The water is sorted; a blend without order costs a third of a picture more, for blocks that are seen through.
        self.plotter.renderer.SetUseOIT(self.traps_air)

    def draw(self, time):
        """Put the stored step nearest to `time` [s] into the window; return its time [s]."""
        time = self.run.nearest(time)
        blocks = self.run.blocks.at(time) if self.run.blocks else None
        if blocks is not None:
            self._draw_blocks(solid_behind_cut(blocks, self.cut))
        if self.run.water:
            water = self.run.water.at(time)
            self._draw_water(water, [body for body in (self.run.solids, blocks) if body is not None])
            self._draw_pockets(water)
        self._draw_time(time)
        self.plotter.reset_camera_clipping_range()
        return time

    def picture(self):
        """The window as (height, width, 3) bytes."""
        self.plotter.render()
        return self.plotter.screenshot(return_img=True)

    def close(self):
        """Free the window."""
        self.plotter.close()

    def _points(self, size):
        """A font size that keeps its share of the picture's height."""
        return max(6, round(self.letters * size * self.size[1] / 720))

    def _draw_time(self, time):
        stamp = f"t = {time:.{decimals(self.run.times)}f} s"
        text = self.plotter.add_text(
            stamp, name="time", position=(0.025, 0.925), viewport=True, font_size=self._points(14),
            color=palette.INK, render=False,
        )  # fmt: skip
        lettered(text.prop)
        caption = self.plotter.add_text(
            self.caption, name="caption", position=(0.985, 1.0 - CAPTION_TOP),
            viewport=True, font_size=self._points(7), color=palette.TANK, render=False,
        )  # fmt: skip
        lettered(caption.prop)
        caption.prop.justification_horizontal = "right"
        caption.prop.justification_vertical = "top"

    def _caption_end(self):
        """How far below the top of the picture the caption ends, as share of its height."""
        line = CAPTION_LINE * self._points(7) / self.size[1]
        return CAPTION_TOP + line * (len(self.caption.splitlines()) + 0.5)

    def _set_lights(self, headlight):
        """Add one sun, a weak light from the right and one from the camera; the light is soft, and no face is black."""
        span = np.linalg.norm(self.upper - self.lower)
        middle = (self.lower + self.upper) / 2
        for way, intensity in ((self.light, 0.5), (self.fill, 0.3)):
            self.plotter.add_light(
                pv.Light(position=middle + 3 * span * way, focal_point=middle, intensity=intensity)
            )
        self.plotter.add_light(pv.Light(light_type="headlight", intensity=headlight))

    def _set_camera(self, azimuth, elevation, eye):
        angle = angle_of(azimuth, elevation)
        below = 0.055 if angle == FAR else 0.0  # the label of the scale bar
        above = self._caption_end()
        view = eye or frame(
            self.lower,
            self.upper,
            self.size[0] / self.size[1],
            azimuth,
            elevation,
            angle,
            margin=(0.04, 0.04, 0.095 + below + BAR * self.letters, max(0.05, above)),
        )
        camera = self.plotter.camera
        camera.position, camera.focal_point, camera.up = view.position, view.focus, view.up
        camera.view_angle = view.view_angle
        if view.view_angle == FAR:  # a parallel projection, from near: depths of shadows have half precision
            away = view.position - view.focus
            distance = np.linalg.norm(away)
            camera.parallel_projection = True
            camera.parallel_scale = distance * np.tan(np.radians(FAR) / 2)
            camera.position = view.focus + away / distance * 2.0 * np.linalg.norm(self.upper - self.lower)

    def _smooth(self, soft):
        """Smooth edges (2 x 2 samples per pixel), and add screen-space ambient occlusion for depth; or neither."""
        self.plotter.disable_anti_aliasing()  # a window has some from the start
        if not soft:
            return
        span = np.linalg.norm(self.upper - self.lower)
        self.plotter.enable_ssao(radius=0.045 * span, bias=0.003 * span, kernel_size=32, blur=True)
        self.plotter.enable_anti_aliasing("ssaa")

    def _line(self, width):
        """A line width that keeps its share of the picture's height; smoothing halves it."""
        return (2 if self.soft else 1) * width * self.size[1] / 720

    def _draw_still_parts(self):
        self.plotter.add_mesh(self.ground, color=palette.GROUND, lighting=False)
        bed = None if self.run.bed is None else ground_behind_cut(self.run.bed, self.cut, self.lower[2])
        if bed is not None and bed.n_cells:
            drawn = self.plotter.add_mesh(bed, color=palette.BED, ambient=0.25, smooth_shading=True)
            behind(drawn.mapper)
        solids = None if self.run.solids is None else closed_behind_cut(self.run.solids, self.cut)
        if solids is not None and solids.n_cells:
            self.plotter.add_mesh(
                solids, color=palette.SOLID, show_edges=True, edge_color="#6b6b6b", ambient=0.3
            )
            self._draw_shadow(solids, "solid_shadow")
        if self.run.tank is not None:
            if self.run.basin is None:
                tank = pv.Box(np.ravel(self.run.tank, order="F")).extract_all_edges()
            else:
                tank = pv.line_segments_from_points(self.run.basin.reshape(-1, 3))
            self.plotter.add_mesh(tank, color=palette.TANK, line_width=self._line(0.9))

    def _draw_north(self, azimuth):
        """Draw a north arrow on the ground of a terrain, at the end of the edge that faces the camera."""
        north = north_of(self.run)
        if north is None:
            return
        side = -1 if np.sin(np.radians(azimuth)) < 0 else 1
        size = 0.09 * (self.upper - self.lower)[:2].max()
        near = (self.lower if side < 0 else self.upper)[1]
        middle = np.array([self.upper[0] - size, near + 0.75 * side * size, self.lower[2]])
        way, across = np.append(north, 0.0), np.array([-north[1], north[0], 0.0])
        corners = middle + size * np.array(
            [0.5 * way, -0.5 * way - 0.22 * across, -0.3 * way, -0.5 * way + 0.22 * across]
        )
        arrow = pv.PolyData(corners, [3, 0, 1, 2, 3, 0, 2, 3])
        self.plotter.add_mesh(arrow, color=palette.INK, lighting=False)
        self.plotter.add_point_labels(
            [middle + 0.8 * size * way], ["N"], font_size=self._points(15), text_color=palette.INK, shape=None,
            show_points=False, always_visible=True, font_file=str(LETTERS), bold=False,
            justification_vertical="center", justification_horizontal="center",
        )  # fmt: skip

    def _draw_scale_bar(self, azimuth):
        """Draw a labelled bar of a round length on the ground, along the edge that faces the camera."""
        side = -1 if np.sin(np.radians(azimuth)) < 0 else 1
        step = 0.03 * side * (self.upper - self.lower)[:2].max()
        length = nice_floor(0.25 * (self.upper[0] - self.lower[0]))
        start = np.array([self.lower[0], (self.lower if side < 0 else self.upper)[1] + step, self.lower[2]])
        bar = pv.Line(start, start + np.array([length, 0.0, 0.0]))
        self.plotter.add_mesh(bar, color=palette.INK, line_width=self._line(2.5))
        self.plotter.add_point_labels(
            [start + np.array([length / 2, 0.7 * step, 0.0])], [f"{length:g} m"], font_size=self._points(15),
            text_color=palette.INK, shape=None, show_points=False, always_visible=True, font_file=str(LETTERS),
            bold=False, justification_vertical="top", justification_horizontal="center",
        )  # fmt: skip

    def _draw_blocks(self, blocks):
        options = (
            {"scalars": "damage", "clim": (0.0, 1.0)}
            if "damage" in blocks.cell_data
            else {"color": "#d9c7a8"}
        )
        self.plotter.add_mesh(
            blocks, name="blocks", cmap=ListedColormap(palette.scale(palette.DAMAGE_ENDS)), show_edges=True,
            edge_color="#5b4a3a", line_width=self._line(0.7), ambient=0.3, show_scalar_bar=False,
            reset_camera=False, render=False, opacity=SEEN_THROUGH if self.traps_air else 1.0, **options,
        )  # fmt: skip
        self._draw_shadow(blocks, "block_shadow")
        if "damage" in blocks.cell_data:
            self._draw_bar(
                self.plotter.actors["blocks"].mapper, "damage of blocks [–]", 0.35 if self.run.water else 0.03
            )

    def _draw_water(self, grid, bodies):
        white = self.fastest if self.foam else None
        surface = water_surface(grid, np.array(self.plotter.camera.position), self._sides(), white)
        surface = self._behind_cut(surface)
        if self.cut is not None:
            surface = with_section(surface, grid, *self.cut, bodies)
        if surface.n_cells == 0:
            self.plotter.remove_actor("water", reset_camera=False, render=False)
            return
        scale = ListedColormap(palette.scale(palette.WATER_ENDS))
        colours = {"scalars": "speed", "clim": (0.0, self.fastest), "opacity": WATER_OPACITY, "cmap": scale}
        if self.foam:
            surface["colour"] = foamy(scale(surface["speed"] / self.fastest), surface["foam"])
            colours = {"scalars": "colour", "rgba": True}
        actor = self.plotter.add_mesh(
            surface, name="water", **colours,
            specular=0.3, specular_power=30, ambient=0.3, show_scalar_bar=False, reset_camera=False, render=False,
        )  # fmt: skip
        behind(actor.mapper)
        mapper = actor.mapper
        if self.foam:
            mapper = pv.DataSetMapper()
            mapper.lookup_table = pv.LookupTable(scale, scalar_range=(0.0, self.fastest))
        self._draw_bar(mapper, "speed of water [m/s]", 0.03)

    def _draw_pockets(self, water):
        """Draw the surface below each pocket of trapped air in a colour of its own, and its pressure in the corner."""
        for k in range(self._pockets_drawn):
            self.plotter.remove_actor(f"pocket{k}", reset_camera=False, render=False)
            self.plotter.remove_actor(f"pocket{k}_told", reset_camera=False, render=False)
        drawn = surfaces_of_pockets(water.nodes, water.cells, water.level_set, water.pocket, water.pressure)
        self._pockets_drawn = min(len(drawn), MOST_POCKETS) + 1
        for k, (number, pressure, triangles) in enumerate(drawn):
            colour = palette.POCKETS[(number - 1) % len(palette.POCKETS)]
            mesh = pv.PolyData.from_regular_faces(
                triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)
            )
            mesh = self._behind_cut(mesh)
            if k < MOST_POCKETS:
                self._tell(k, f"air {number}: {pressure / 1000.0:.3g} kPa", colour)
                if mesh.n_cells:
                    self.plotter.add_mesh(
                        mesh, name=f"pocket{k}", color=colour, ambient=0.5, reset_camera=False, render=False
                    )
        if len(drawn) > MOST_POCKETS:
            self._tell(MOST_POCKETS, f"and {len(drawn) - MOST_POCKETS} more", palette.INK)

    def _tell(self, line, words, colour):
        """Write a line in the upper right corner, below the caption."""
        below = self._caption_end() + 0.042 * self.letters * line
        text = self.plotter.add_text(
            words, name=f"pocket{line}_told", position=(0.985, 1.0 - below),
            viewport=True, font_size=self._points(11), color=colour, render=False,
        )  # fmt: skip
        lettered(text.prop)
        text.prop.justification_horizontal = "right"
        text.prop.justification_vertical = "top"

    def _sides(self):
        """Corners of a tank whose sides are all flat; None of a basin of another shape."""
        return self.run.tank if self.run.basin is None else None

    def _behind_cut(self, mesh):
        """The part of a mesh behind the cut."""
        if self.cut is None or mesh.n_cells == 0:
            return mesh
        normal, origin = self.cut
        return mesh.clip(normal=normal, origin=origin, crinkle=False)

    def _draw_bar(self, mapper, title, left):
        """A colour bar under the scene for the colours of a mapper, once."""
        if title in self.plotter.scalar_bars:
            return
        bar = self.plotter.add_scalar_bar(
            title=title, mapper=mapper, n_labels=2, fmt="%.3g", vertical=False,
            width=0.26, height=BAR * self.letters, position_x=left, position_y=0.03, color=palette.INK, render=False,
            title_font_size=self._points(17), label_font_size=self._points(15), unconstrained_font_size=True,
        )  # fmt: skip
        lettered(bar.GetTitleTextProperty())
        lettered(bar.GetLabelTextProperty())

    def _draw_shadow(self, mesh, name):
        """Draw the shadow of a mesh on the ground: the mesh projected along the light onto the plate."""
        flat = pv.PolyData(
            mesh.points - (mesh.points[:, 2:] - self.lower[2]) * self.light / self.light[2], mesh.faces
        )
        flat.points[:, 2] = self.lower[2] + 1e-3 * (self.upper[2] - self.lower[2])
        low, high = corners(self.ground)
        for axis in (0, 1):
            way = np.eye(3)[axis]
            if flat.n_cells and flat.points[:, axis].max() > high[axis]:
                flat = flat.clip(normal=way, origin=way * high[axis])
            if flat.n_cells and flat.points[:, axis].min() < low[axis]:
                flat = flat.clip(normal=-way, origin=way * low[axis])
        self.plotter.remove_actor(name, reset_camera=False, render=False)
        if flat.n_cells:
            self.plotter.add_mesh(
                flat, name=name, color=palette.SHADOW, lighting=False, reset_camera=False, render=False
            )


CAPTION_LETTERS = 31
"""Letters in a line of the caption per width of one picture height, so that the caption ends beside the time."""
CAPTION_TOP, CAPTION_LINE = 0.015, 2.05
"""Where the caption begins below the top of a picture, as share of its height; pixels of a line per point."""


def camera_inside(run, azimuth):
    """The camera among the blocks in their initial places; without an azimuth it looks towards where damage begins."""
    from coupler.commands.view.inside import NoInside, inside

    if not run.blocks:
        raise NoInside("--view inside: the run has no blocks")
    where = where_it_happens(run)
    if azimuth is None:
        azimuth = float(np.degrees(np.arctan2(where[1], where[0]))) if where.any() else 180.0
    return inside(run.blocks.at(run.blocks.times[0]), azimuth)


def foamy(colours, share):
    """Colours (n, 4), as bytes, of water with a share of foam (n,): whiter and less transparent."""
    share = share[:, None]
    rgb = colours[:, :3] * (1.0 - share) + share
    opacity = WATER_OPACITY + (1.0 - WATER_OPACITY) * share
    return np.rint(255 * np.concatenate([rgb, opacity], axis=1)).astype(np.uint8)


def cut_of(cut, azimuth):
    """Normal and point of a cut across an axis, the normal towards the camera."""
    axis, place = cut
    normal, origin = np.zeros(3), np.zeros(3)
    origin[axis] = place
    towards = [np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth)), 1.0][axis]
    normal[axis] = 1.0 if towards >= 0.0 else -1.0
    return normal, origin


def water_surface(water, eye, tank=None, foam_over=None):
    """The skin of the water as a mesh with "speed" [m/s] and shading normals at its points, and with "foam" (0 to 1)
    where it is asked for, over that speed [m/s].

    Triangles that the eye (3,) sees from behind are left out. The farthest come first: each is then seen through
    those before it, where otherwise the order of the cells would decide which of two layers shows, triangle by
    triangle."""
    found = skin(water.nodes, water.cells, water.level_set, water.fraction, tank)
    found = found.of_triangles(facing(found.of(water.nodes), eye))
    corners = found.of(water.nodes)
    far_first = np.argsort(-np.linalg.norm(corners.mean(axis=1) - eye, axis=1), kind="stable")
    normals = shading_normals(found, water.nodes, water.cells, water.level_set)
    speed = np.linalg.norm(found.of(water.velocity), axis=2)
    mesh = pv.PolyData.from_regular_faces(
        corners[far_first].reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)
    )
    mesh["speed"] = speed[far_first].ravel()
    if foam_over is not None:
        white = foam(water.nodes, water.cells, water.level_set, water.velocity, foam_over)
        share = found.of(white) * (np.arange(len(corners)) < found.free)[:, None]
        mesh["foam"] = share[far_first].ravel()
    mesh["normals"] = normals[far_first].reshape(-1, 3)
    mesh.point_data.active_normals_name = "normals"
    return mesh


def ground(lower, upper, room_for_shadows):
    """A plate under the scene, a little larger than it."""
    margin = 0.06 * (upper - lower)[:2].max() + (0.15 * (upper - lower)[2] if room_for_shadows else 0.0)
    x = [lower[0] - margin, upper[0] + margin]
    y = [lower[1] - margin, upper[1] + margin]
    z = lower[2] - 2e-3 * (upper[2] - lower[2])
    return pv.PolyData([[x[0], y[0], z], [x[1], y[0], z], [x[1], y[1], z], [x[0], y[1], z]], [4, 0, 1, 2, 3])


def behind(mapper):
    """Draw a surface behind others that coincide with it, such as a block in the plane of a wall of the water."""
    mapper.SetResolveCoincidentTopologyToPolygonOffset()
    mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(1.0, 8.0)


def turned(vector, angle):
    """`vector` (3,) turned about z by `angle` [degree]."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    return np.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1], vector[2]])


def lettered(text):
    """Set a VTK text property in a plain sans-serif face."""
    text.SetFontFamily(VTK_FONT_FILE)
    text.SetFontFile(str(LETTERS))
    text.BoldOff()
    text.ItalicOff()
