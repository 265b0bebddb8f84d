"""Short digests of a scene and of the program that ran it, by which a restart with another scene or program is
refused."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

import numpy as np

from coupler.case.paths import stamp
from coupler.program import provenance
from coupler.program.quantities import counted

FREE = (
    "time.",
    "coupling.",
    "limits.",
    "verdict.damaged_joints",
    "verdict.collapsed_weight",
    "verdict.collapsed_joints",
    "case.title",
    "case.description",
)
"""Names of the case that may change when a run goes on; with a dot at the end: a whole section."""
FILE_KEYS = ("path", "surface")
"""Keys of a case whose values name files, that of the mesh aside, which is compared as a mesh."""
ALL_FILE_KEYS = (*FILE_KEYS, "mesh")


def scene_parts(coupling) -> dict[str, str]:
    """Digests of the mesh, the blocks and the joints of a scene."""
    parts = {}
    if coupling.water is not None:
        mesh = coupling.water.mesh
        parts["mesh"] = _reported(
            f"{len(mesh.nodes)} nodes, {len(mesh.cells)} cells", mesh.nodes, mesh.cells.astype(np.int64)
        )
    structure = coupling.structure
    if structure is not None:
        shapes = np.concatenate([np.zeros((0, 3)), *structure.shape_vertices])
        parts["blocks"] = _reported(counted(structure.n, "block"), shapes, structure.mass, structure.fixed)
        joints = structure.joints
        if joints is not None:
            arrays = (joints.a, joints.b, joints.xi_a, joints.xi_b, joints.weight, joints.law)
            parts["joints"] = _reported(counted(len(joints), "joint"), *arrays)
    return parts


def file_digests(case: dict, keys: tuple[str, ...] = FILE_KEYS) -> dict[str, str]:
    """Digest of each file that an effective case names under `keys`, by its path; files of a study, which no run reads,
    left out."""
    named = {section: value for section, value in case.items() if section != "study"}
    names = sorted(set(_named(named, keys)))
    return {name: _of_file(name, stamp(name)) for name in names if Path(name).is_file()}


def run_inputs(case: dict) -> dict[str, dict[str, str]]:
    """What a run of an effective case reads besides it: digests of the files that it names, that of its mesh included,
    and checksums of joint laws from outside of the program; empty where there is neither."""
    found = {
        "files": file_digests(case, ALL_FILE_KEYS),
        "laws": _outside_laws(case.get("joints") or {}),
    }
    return {kind: digests for kind, digests in found.items() if digests}


def _outside_laws(joints: dict) -> dict[str, str]:
    """Checksum of each law of the joints that did not come with the program."""
    used = {table["law"] for table in (joints, *joints.get("pair", ())) if table.get("law")}
    if not used:
        return {}
    from yade_scripts.joints import laws

    return {name: laws.identity(name)["checksum"] for name in sorted(used - {*laws.shipped()})}


def _named(value: object, keys: tuple[str, ...]) -> Iterator[str]:
    """Strings under `keys`, anywhere in a table."""
    if isinstance(value, dict):
        for key, entry in value.items():
            if key in keys and isinstance(entry, str):
                yield entry
            else:
                yield from _named(entry, keys)
    elif isinstance(value, list):
        for entry in value:
            yield from _named(entry, keys)


@lru_cache
def _of_file(path: str, _stamp: tuple[int, int]) -> str:
    """Read piece by piece: a raster may be larger than the memory that a run has to spare."""
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, _new_digest).hexdigest()


def _new_digest():
    return hashlib.blake2b(digest_size=4)


def _digest(*parts: bytes) -> str:
    digest = _new_digest()
    for part in parts:
        digest.update(part)
    return digest.hexdigest()


def _reported(count: str, *arrays) -> str:
    return f"{count} ({_digest(*(np.ascontiguousarray(array).tobytes() for array in arrays))})"


def program() -> dict[str, str]:
    """Versions on which the last digit may depend, and the commit of the checkout."""
    git = provenance.git_state()
    return provenance.versions() | ({"commit": git["commit"][:12]} if git else {})


def differences(then: object, now: object, name: str = "") -> list[str]:
    """`name: was ..., is ...` for every value that differs between two tables."""
    if isinstance(then, dict) and isinstance(now, dict):
        keys = [*then, *(key for key in now if key not in then)]
        inner = [differences(then.get(k), now.get(k), f"{name}.{k}" if name else k) for k in keys]
        return [line for lines in inner for line in lines]
    if isinstance(then, list) and isinstance(now, list) and len(then) == len(now):
        inner = [differences(a, b, f"{name}[{k}]") for k, (a, b) in enumerate(zip(then, now))]
        return [line for lines in inner for line in lines]
    return [] if then == now else [f"{name}: was {_shown(then)}, is {_shown(now)}"]


def case_differences(then: dict, now: dict) -> list[str]:
    """Those between two effective cases that change the scene or its results so far."""
    found = differences(_as_written(then), _as_written(now))
    return [line for line in found if not any(is_free(line.partition(":")[0], name) for name in FREE)]


def _as_written(case: dict) -> dict:
    """The case without values that the tank takes from its mesh file; a change of these is reported with the mesh."""
    tank = case.get("tank") or {}
    if "mesh" not in tank:
        return case
    return case | {"tank": {key: tank[key] for key in tank if key not in ("lower", "upper", "cell")}}


def is_free(key: str, name: str) -> bool:
    """Whether the key of a case has the given name, or lies inside that section (a name that ends with a dot)."""
    return key.startswith(name) if name.endswith(".") else key == name


def _shown(value: object) -> str:
    text = "absent" if value is None else str(value)
    return text if len(text) <= 60 else text[:57] + "..."
