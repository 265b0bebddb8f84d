"""STEP, IGES and IFC as closed surfaces of triangles, by gmsh (extra `cad`) and ifcopenshell (extra `ifc`)."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.geometry.mesh_files import MeshFileError

TRIANGLE = 2
"""The kind of an element, as gmsh counts them."""
UNNAMED = "Open CASCADE"
"""Beginning of the default names of bodies without a name in the file."""
ANGLE = 12
"""Straight pieces of a circle that is drawn in a STEP file: a curved wall becomes so many plane ones."""


def read(path: Path) -> dict[str, tuple[Array, Array]]:
    """Points (n, 3) and triangles (m, 3) of each body, in metres, by the name that the file gives it.

    Raises MeshFileError."""
    found = _of_ifc(path) if path.suffix.lower() == ".ifc" else _of_step(path)
    bodies: dict[str, tuple[Array, Array]] = {}
    for name, points, triangles in found:
        valid = re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_-") or "body"
        valid = valid[:50] if valid[0].isalpha() else f"layer_{valid[:44]}"
        if valid in bodies:
            before = bodies[valid]
            points = np.concatenate([before[0], points])
            triangles = np.concatenate([before[1], triangles + len(before[0])])
        bodies[valid] = points, triangles
    if not bodies:
        raise MeshFileError(f"{path.name}: holds no solids; write closed bodies")
    return bodies


def _of_step(path: Path) -> Iterator[tuple[str, Array, Array]]:
    """One surface for each volume; corners of a name like `Shapes/House/wall` count as the layer `wall`."""
    import gmsh
    import trimesh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setString("Geometry.OCCTargetUnit", "M")
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", ANGLE)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 1e22)
        gmsh.model.occ.importShapes(str(path))
        gmsh.model.occ.synchronize()
        gmsh.model.mesh.generate(2)
        tags, flat, _ = gmsh.model.mesh.getNodes()
        row = np.zeros(int(tags.max(initial=0)) + 1, np.int64)
        row[tags] = np.arange(len(tags))
        points = flat.reshape(-1, 3)
        for _, volume in gmsh.model.getEntities(3):
            triangles = []
            for _, face in gmsh.model.getBoundary([(3, volume)], oriented=False):
                kinds, _, nodes = gmsh.model.mesh.getElements(2, face)
                triangles += [
                    row[ends].reshape(-1, 3) for kind, ends in zip(kinds, nodes) if kind == TRIANGLE
                ]
            mesh = trimesh.Trimesh(points, np.concatenate(triangles))
            mesh.fix_normals()
            name = gmsh.model.getEntityName(3, volume).rsplit("/", 1)[-1]
            named = name and not name.startswith(UNNAMED)
            yield name if named else "all", np.array(mesh.vertices), np.array(mesh.faces)
    except Exception as error:  # gmsh raises the plain class
        raise MeshFileError(f"{path.name}: gmsh cannot read it: {error}") from error
    finally:
        gmsh.finalize()


def _of_ifc(path: Path) -> Iterator[tuple[str, Array, Array]]:
    """Walls, slabs, roofs, stairs, columns, beams and foundations, by their material or else their kind."""
    import ifcopenshell
    import ifcopenshell.geom
    import ifcopenshell.util.element

    kinds = (
        "IfcWall",
        "IfcSlab",
        "IfcRoof",
        "IfcStair",
        "IfcStairFlight",
        "IfcColumn",
        "IfcBeam",
        "IfcFooting",
    )
    try:
        file = ifcopenshell.open(str(path))
        settings = ifcopenshell.geom.settings()
        settings.set("use-world-coords", True)
        for kind in kinds:
            for element in file.by_type(kind):
                if element.Representation is None:
                    continue
                shape = ifcopenshell.geom.create_shape(settings, element).geometry
                material = ifcopenshell.util.element.get_material(element, should_skip_usage=True)
                name = getattr(material, "Name", None) or kind.removeprefix("Ifc").lower()
                points = np.array(shape.verts, float).reshape(-1, 3)
                yield name, points, np.array(shape.faces, np.int64).reshape(-1, 3)
    except Exception as error:  # ifcopenshell raises anything
        raise MeshFileError(f"{path.name}: ifcopenshell cannot read it: {error}") from error
