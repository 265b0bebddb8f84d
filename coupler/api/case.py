"""A case as an object for scripts: it is loaded or built, changed by the keys of the case file, checked, and run."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coupler.api.execution import Callback, execute, only_run
from coupler.api.run import Run
from coupler.api.step import Step
from coupler.case import toml_text
from coupler.case.case import effective
from coupler.checks.read_case import ABSENT, CaseFile, changed, from_text, load, table_of
from coupler.checks.remarks import remarks
from coupler.program.errors import SurgebreakError
from coupler.run.directory import RunDirectory

if TYPE_CHECKING:
    from coupler.run.forecast import Forecast


class Case:
    """A case that a script may change. Made by `load`, or from tables as a case file has them:

        Case({"case": {"title": "a drop"}, "time": {"end": "1 s"}, "tank": {...}, "water": {...}})

    Names, units and errors are those of the case file (docs/case_file.md): numbers are in SI units, texts may carry
    units. A change of an unknown name or to a value that is not permitted raises BadCase at once and changes nothing;
    the consistency of values with one another is examined by `check` and `run`.
    """

    def __init__(self, tables: Mapping[str, Any], directory: Path | str = "."):
        """directory: to which paths in the case are relative, and in which `run` creates `runs/`.

        Raises TypeError for values that a case file cannot contain.
        """
        self._text = toml_text.document(tables)
        self._place: Path | None = None
        self._directory = Path(directory)
        self._changes: list[str] = []
        self._table = table_of(self._text, "case")

    @classmethod
    def load(cls, place: Path | str, changes: Iterable[str] = ()) -> Case:
        """The case at a place, a `case.toml` or its directory, with changes `KEY=VALUE` as `--set` takes them.

        Raises BadCase.
        """
        file = load(place, changes)
        found = cls.__new__(cls)
        found._text, found._place, found._directory = file.text, file.path, file.directory
        found._changes = []
        found._table = table_of(file.text, str(file.path))
        for change in file.overrides:
            found._change(change)
        return found

    # ------------------------------------------------------------ values

    def set(self, key: str, value: Any) -> Case:
        """Set a key of the case file to a value: `set("tank.cell", "10 cm")`, `set("structure.block[0].density",
        900)`.

        value: a number (SI), a text with a unit, a boolean, a list or array, a table; None removes the key.
        Raises BadCase (an unknown name, a wrong unit, out of range) and TypeError. Returns the case, so that calls
        can follow one another.
        """
        self._change(f"{key}={ABSENT if value is None else toml_text.inline(value)}")
        return self

    def add(self, section: str, **values: Any) -> Case:
        """Add an item to a list of tables: `add("gauge", kind="level", name="in_front", at=[2.2, 0.5])`.

        Raises BadCase and TypeError, as `set`.
        """
        return self.set(f"{section}[+]", values)

    def get(self, key: str) -> Any:
        """The value as it was written or set, or None where it was not; `effective` contains the defaults."""
        found: Any = self._table
        for part in key.replace("[", ".[").split("."):
            try:
                found = found[int(part[1:-1]) if part.startswith("[") else part]
            except (KeyError, IndexError, TypeError, ValueError):
                return None
        return found

    def __getitem__(self, key: str) -> Any:
        found = self.get(key)
        if found is None:
            raise KeyError(f"{key}: not written in this case; `effective` has the defaults")
        return found

    def __setitem__(self, key: str, value: Any) -> None:
        self.set(key, value)

    def __delitem__(self, key: str) -> None:
        self.set(key, None)

    def __contains__(self, key: str) -> bool:
        return self.get(key) is not None

    def copy(self) -> Case:
        """An independent copy of the case."""
        found = Case.__new__(Case)
        found.__dict__.update(self.__dict__, _changes=list(self._changes))
        return found

    @property
    def changes(self) -> tuple[str, ...]:
        """The changes made by `set` and `add`, in the form of `--set` on the command line."""
        return tuple(self._changes)

    @property
    def effective(self) -> dict[str, Any]:
        """All values in SI units, including defaults. Raises BadCase."""
        return effective(self.file().case)

    def __repr__(self) -> str:
        title = self.get("case.title")
        return f"<surgebreak.Case {title!r}, {self._place or 'from a script'}, {len(self._changes)} changes>"

    def _change(self, change: str) -> None:
        self._table = changed(self._table, change)
        self._changes.append(change)

    # ------------------------------------------------------------ what to do with it

    def file(self) -> CaseFile:
        """The checked case in the form that the rest of the program uses. Raises BadCase with a line for each
        mistake."""
        if self._place is not None:
            return load(self._place, self._changes, text=self._text)
        return from_text(self._text, "case", self._directory, self._changes)

    def save(self, directory: Path | str) -> Path:
        """Write the case with its changes to `case.toml` in a directory, and return the path of the file.

        Paths in the case are not changed, and are then relative to that directory. Raises SurgebreakError if the file
        exists.
        """
        path = Path(directory) / "case.toml"
        if path.exists():
            raise SurgebreakError(f"{path}: exists and is left as it is; name another directory")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(toml_text.document(self._table), encoding="utf-8")
        return path

    def check(self, exact: bool = False) -> Forecast:
        """Check the case and forecast steps, substep, memory and disk; for a structure YADE is loaded.

        exact: also solve for the exact highest frequency of the joints. Returns `Forecast`: `rows` of name, value,
        unit, remark, and `remarks`. Raises BadCase.
        """
        file = self.file()
        from coupler.run.forecast import forecast

        with only_run():
            found = forecast(file.case, exact, file.directory)
        return replace(found, remarks=tuple(remarks(file.case)))

    def run(
        self,
        output: Path | str | None = None,
        callback: Callback | None = None,
        stop: Callable[[Step], object] | None = None,
        quiet: bool = True,
    ) -> Run:
        """Run the case in this process, to its end or until `stop`, and return the `Run`.

        output: a new or empty directory; None: `runs/<time>-<hash>` beside the case ·
        callback: called after every step with a `Step` · stop: called after each step; a true result ends the run, and
        a text is recorded as the reason · quiet: print nothing (the log of the run is written).

        A run that `stop`, Ctrl-C or a file named `stop` ended has the status "stopped", and `Run.resume` goes on.
        Raises BadCase, RunDirectoryExists, RunInRun, Diverged, LimitReached (a limit of the case), and what the
        callback raises; the results written until then remain and can be read with `surgebreak.open`.
        """
        file = self.file()
        with only_run():
            directory = RunDirectory.create(file, None if output is None else Path(output))
            execute(file, directory, None, callback, stop, quiet)
        return Run(directory.path)
