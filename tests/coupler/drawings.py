"""Drawings for the tests, made by the solid modeller: a house of three rooms, an L-shaped building of two storeys."""

import numpy as np
import trimesh
from manifold3d import Manifold


def box(low, high):
    """The body between two corners [m]."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    return Manifold.cube((high - low).tolist()).translate(low.tolist())


HOUSE_OPENINGS = (
    ((1, -1, 0), (2, 1, 2.1)), ((3, -1, 0.9), (4.4, 1, 2.1)), ((6.5, -1, 0.9), (7.7, 1, 2.1)),
    ((1.2, 6, 0.9), (2.6, 8, 2.1)), ((6, 6, 0.9), (7.4, 8, 2.1)), ((-1, 1.5, 0.9), (1, 2.7, 2.1)),
    ((8, 1.5, 0.9), (10, 2.7, 2.1)), ((2, 3.5, 0), (3, 4.5, 2.1)), ((4.5, 2, 0), (5.5, 3, 2.1)),
)  # fmt: skip
"""Three doors, two of them inside, and six windows."""


def house(thickness=0.25):
    """9 x 7 x 3 m, three rooms, nine openings, walls and a flat roof of one thickness [m]."""
    t = thickness
    body = box((0, 0, 0), (9, 7, 3)) - box((t, t, 0), (9 - t, 7 - t, 3 - t))
    body += box((t, 4, 0), (9 - t, 4 + t, 3 - t)) + box((5, t, 0), (5 + t, 4, 3 - t))
    for low, high in HOUSE_OPENINGS:
        body -= box(low, high)
    return body


def ell():
    """An L of 12 x 10 m with two storeys of 3 m, thirteen openings, and a stair of eight steps in a stairwell."""
    t = 0.3

    def foot(e, low, high):
        return box((e, e, low), (12 - e, 5 - e, high)) + box((e, e, low), (5 - e, 10 - e, high))

    body = foot(0, 0, 6) - foot(t, 0, 2.75) - foot(t, 3, 5.75)
    for z in (0, 3):
        for x0, y0, x1, y1 in (
            (2, -1, 3.5, 1), (6, -1, 7.5, 1), (11, 2, 13, 3.2), (7, 4, 8.5, 6), (-1, 6.5, 1, 8), (2, 9, 3.2, 11),
        ):  # fmt: skip
            body -= box((x0, y0, z + 0.9), (x1, y1, z + 2.1))
    body -= box((9, -1, 0), (10, 1, 2.1))
    body -= box((1.3, 6, 2.7), (2.5, 9.2, 3.1))
    for i in range(8):
        body += box((1.3, 6 + 0.4 * i, 0), (2.5, 6.4 + 0.4 * i, 3.0 * (i + 1) / 8))
    return body


def mesh(body):
    """Vertices (n, 3) [m] and triangles (m, 3) of a body."""
    found = body.to_mesh64()
    return np.array(found.vert_properties)[:, :3], np.array(found.tri_verts, dtype=int)


def write(path, **bodies):
    """Write bodies by name; as layers where the format has them."""
    parts = {name: trimesh.Trimesh(*mesh(body), process=False) for name, body in bodies.items()}
    if path.suffix == ".obj":
        write_obj(path, parts)
    else:
        trimesh.util.concatenate(list(parts.values())).export(path)
    return path


def write_obj(path, parts):
    """With all digits and an object for each body."""
    lines, first = [], 1
    for name, part in parts.items():
        lines.append(f"o {name}")
        lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in part.vertices.tolist()]
        lines += ["f " + " ".join(str(first + k) for k in row) for row in part.faces.tolist()]
        first += len(part.vertices)
    path.write_text("\n".join(lines) + "\n")
