"""The state of a structure as arrays, to which `Structure.restore` returns in this process or in a new one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Array, Floats

_OPTIONAL = ("joints", "contacts", "sleep")


class OtherStructure(ValueError):
    """A state does not belong to the structure that is to take it over."""


@dataclass(frozen=True, kw_only=True)
class StructureState:
    """Everything in a structure that changes in time; the rest follows from its construction.

    motion (n, 16): position 3, orientation 4, velocity 3, spin 3, angular momentum 3 of each block, of half a substep
    before the positions · time [s] · dt [s] of the last substep · load (n, 6) that is held · lent_spin (n, 3)
    onset: loose blocks and places they stood in · sums [J] · joints, contacts: their histories, sleep: who sleeps, None
    without
    """

    motion: Floats
    time: float
    dt: float
    load: Floats
    lent_spin: Floats
    onset: dict[str, Array]
    sums: dict[str, float]
    joints: dict[str, Array] | None
    contacts: dict[str, Array] | None
    sleep: dict[str, Array] | None = None

    def arrays(self) -> dict[str, Array]:
        """Flat, for any file of named arrays: `numpy.savez(path, **state.arrays())`."""
        flat: dict[str, Array] = {}
        for name, value in vars(self).items():
            if isinstance(value, dict):
                flat |= {f"{name}/{inner}": np.asarray(v) for inner, v in value.items()}
            elif value is not None:
                flat[name] = np.asarray(value)
        return flat

    @classmethod
    def of(cls, arrays) -> StructureState:
        """The state whose `arrays` these are, read from a file. arrays: mapping, for instance of `numpy.load`.

        Raises OtherStructure if some are missing."""
        found = {name: np.asarray(arrays[name]) for name in arrays}
        parts = {name: _below(name, found) for name in ("onset", "sums", *_OPTIONAL)}
        missing = [name for name in ("motion", "time", "dt", "load", "lent_spin") if name not in found]
        missing += [name for name in ("onset", "sums") if not parts[name]]
        if missing:
            raise OtherStructure(f"not the state of a structure: {', '.join(missing)} missing")
        return cls(
            motion=found["motion"],
            time=float(found["time"]),
            dt=float(found["dt"]),
            load=found["load"],
            lent_spin=found["lent_spin"],
            onset=parts["onset"],
            sums={name: float(value) for name, value in parts["sums"].items()},
            joints=parts["joints"] or None,
            contacts=parts["contacts"] or None,
            sleep=parts["sleep"] or None,
        )


def _below(name: str, arrays: dict[str, Array]) -> dict[str, Array]:
    """The arrays whose names begin with `name/`, without this prefix."""
    return {key[len(name) + 1 :]: value for key, value in arrays.items() if key.startswith(name + "/")}


def check_belongs(state: StructureState, blocks: int, points: int | None, meets: bool, sleeps: bool) -> None:
    """Raise OtherStructure unless the state has so many blocks and points of joints (None: no joints), contact, and
    sleep."""
    found = None if state.joints is None else len(state.joints["largest"])
    wrong = [
        f"{what}: {theirs or 'none'} in the state, {ours or 'none'} here"
        for what, theirs, ours in (
            ("blocks", len(state.motion), blocks),
            ("points of joints", found, points),
            ("contact", state.contacts is not None, meets),
            ("sleep", state.sleep is not None, sleeps),
        )
        if theirs != ours
    ]
    if wrong:
        raise OtherStructure(
            f"the state belongs to another structure ({'; '.join(wrong)}); build it from the same blocks and laws"
        )
