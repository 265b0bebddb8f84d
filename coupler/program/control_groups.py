"""The control groups of this process: what a container or a batch job gives it of the machine."""

from __future__ import annotations

from pathlib import Path

ROOT = Path("/sys/fs/cgroup")
OWN = Path("/proc/self/cgroup")


def groups(controller: str, root: Path = ROOT, own: Path = OWN) -> list[Path]:
    """Folders of the groups of this process and of those around them, of version 2 and, of a controller such as
    "memory", of version 1. They need not exist: a container sees its own group as the root."""
    try:
        lines = own.read_text(encoding="ascii").splitlines()
    except OSError:
        lines = []
    found = [root, root / controller]
    for line in lines:
        _, controllers, path = line.split(":", 2)
        if not controllers:
            found += _up_to(root, root / path.lstrip("/"))
        elif controller in controllers.split(","):
            found += _up_to(root, root / controller / path.lstrip("/"))
    return list(dict.fromkeys(found))


def _up_to(root: Path, place: Path) -> list[Path]:
    return [place, *(above for above in place.parents if above.is_relative_to(root))]
