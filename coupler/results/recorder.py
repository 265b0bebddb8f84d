"""Writing the results of a run: histories every step, fields at the output times, the crack table.

`history/energy.csv`   energy               `history/momentum.csv`, `angular_momentum.csv`  the balance of momentum
`history/coupling.csv` how each step went   `history/water.csv`     volume
`history/gauges.csv`   the gauges           `history/structure.csv` joints, fastest block
`maps/*.asc`           of a flood over terrain
`history/air.csv`      pockets, where air is trapped
`history/loads_*.csv`  loads by their origin, where a case asks for them
`cracks.csv`, `blocks.csv`  the final state of each joint and block; the verdict is in run.json
"""

from __future__ import annotations

import numpy as np

from array_types import Array
from coupler.geometry.tank_mesh import basin_edges
from coupler.results.columns import (
    AIR,
    COUPLING,
    ENERGY,
    MOMENTUM_TITLE,
    STRUCTURE,
    STRUCTURE_LINES,
    WATER,
    momentum_columns,
)  # fmt: skip
from coupler.results.cracks import crack_columns, write_crack_surfaces, write_cracks
from coupler.results.fields import BlockWriter, WaterWriter, write_solids
from coupler.results.history import HistoryTable
from coupler.results.tank_top import TankTop
from coupler.step.observe import block_damage, fastest_point, joint_counts


class Recorder:
    """Writes the results of a run step by step; a side that is absent has no files.

    directory: of the run · coupling: CoupledStepper · gauges: list of Gauge
    solids: [(vertices, faces)] that never move, with a structure its last blocks ·
    tank: (lower, upper) or None · kept: what `save` gave, to continue the files from there · watch: of the verdict,
    None without a structure · maps: of a flood over terrain, or None. Raises CannotContinue.
    """

    def __init__(self, directory, coupling, gauges, solids, tank, kept=None, watch=None, maps=None):
        self.coupling, self.gauges, self.watch, self.maps = coupling, gauges, watch, maps
        self.history = directory / "history"
        self.history.mkdir(exist_ok=True)
        self.cracks = directory / "cracks.csv"
        self.each_block = directory / "blocks.csv"
        water, structure = coupling.water, coupling.structure
        self.impulse = np.zeros(3)
        self.reinserted, self.clipped = 0.0, 0
        self.reinserted_net = self.left = self.parted = 0.0
        self.readings: dict[str, float | None] = {}
        """Values of the gauges of the common table in the last step."""
        self._kept = kept
        self._tables: dict[str, HistoryTable] = {}
        self._energy = self._table("energy", ENERGY)
        self._coupling = self._table("coupling", COUPLING)
        about = "({:g}, {:g}, {:g})".format(*coupling.momentum.about)
        of = f"angular momentum about {about}"
        self._momentum = self._table("momentum", momentum_columns("N s", "momentum"), MOMENTUM_TITLE)
        self._angular = self._table(
            "angular_momentum", momentum_columns("N m s", of), f"angular {MOMENTUM_TITLE}"
        )
        self._water = self._table("water", WATER) if water else None
        self._air = self._table("air", AIR) if water and water.air is not None else None
        self._structure = self._table("structure", STRUCTURE) if structure else None
        self._gauges = self._table("gauges", self._gauge_columns()) if self._together() else None
        self._own = [(gauge, self._table(gauge.table, gauge.columns)) for gauge in gauges if gauge.table]
        self.top = TankTop(water) if water else None
        self._written = 0 if kept is None else int(kept["outputs"])
        keep = None if kept is None else self._written
        self._fields = WaterWriter(directory / "fields.vtkhdf", keep=keep) if water else None
        self._blocks = None
        if structure:
            s = structure
            self._n_blocks = s.n - len(solids)
            shapes = (s.shape_vertices, s.shape_faces, s.names, s.groups)
            own = (values[: self._n_blocks] for values in shapes)
            self._blocks = BlockWriter(directory / "blocks.vtkhdf", *own, keep=keep)
        if kept is not None:
            self._restore_sums(kept)
        elif solids or tank:
            basin = basin_edges(water.mesh) if water else None
            bodies = ([v for v, _ in solids], [f for _, f in solids])
            write_solids(directory / "solids.vtkhdf", *bodies, tank, basin=basin)
        if kept is None and structure is not None and structure.joints is not None:
            rows = {
                "joint": np.arange(len(structure.joints)),
                "a": structure.joints.a,
                "b": structure.joints.b,
            }
            write_crack_surfaces(directory / "joints.vtu", *structure.joint_polygons(at_start=True), rows)

    def _table(self, name: str, columns, title: str | None = None) -> HistoryTable:
        keep = None if self._kept is None else self._kept[f"table_{name}"].tolist()
        self._tables[name] = HistoryTable(self.history / f"{name}.csv", columns, title, keep)
        return self._tables[name]

    def _restore_sums(self, kept) -> None:
        self.impulse = kept["impulse"].copy()
        self.reinserted, self.clipped = float(kept["reinserted"]), int(kept["clipped"])
        self.reinserted_net, self.left = float(kept["reinserted_net"]), float(kept["left"])
        self.parted = float(kept["parted"])
        for k, gauge in enumerate(self.gauges):
            if gauge.windows is not None:
                gauge.windows.restore(_below(f"gauge_{k}_", kept))
        if self.watch is not None:
            self.watch.restore(_below("watch_", kept))
        if self.maps is not None:
            self.maps.restore(_below("maps_", kept))
        if self.top is not None:
            self.top.restore(_below("top_", kept))
        self._write_tables()

    def _gauge_memory(self) -> dict[str, Array]:
        """What the gauges have accumulated, by number of the gauge."""
        return {
            f"gauge_{k}_{name}": array
            for k, gauge in enumerate(self.gauges)
            if gauge.windows is not None
            for name, array in gauge.windows.save().items()
        }

    def save(self) -> dict[str, Array]:
        """The sums so far and the lengths of the files: written states, rows and bytes of each table."""
        places = {f"table_{name}": np.array(table.place) for name, table in self._tables.items()}
        return (
            places
            | self._gauge_memory()
            | {f"watch_{name}": a for name, a in (self.watch.save() if self.watch else {}).items()}
            | {f"maps_{name}": a for name, a in (self.maps.save() if self.maps else {}).items()}
            | {f"top_{name}": a for name, a in (self.top.save() if self.top else {}).items()}
            | {
                "outputs": np.array(self._written),
                "impulse": self.impulse.copy(),
                "reinserted": np.array(self.reinserted),
                "reinserted_net": np.array(self.reinserted_net),
                "left": np.array(self.left),
                "parted": np.array(self.parted),
                "clipped": np.array(self.clipped),
            }
        )

    def _together(self):
        """The gauges that share a table."""
        return [gauge for gauge in self.gauges if gauge.table is None]

    def _gauge_columns(self):
        return [("time", "s", "time"), *(column for gauge in self._together() for column in gauge.columns)]

    def step(self, record) -> None:
        """Append one row to each history."""
        c = self.coupling
        b = record.balance
        e = record.energies
        self._energy.append(
            time=record.time,
            water_kinetic=b.water_kinetic,
            water_potential=b.water_potential,
            numerical_dissipation=b.numerical_dissipation,
            shear_dissipation=b.shear_dissipation,
            parting_work=b.parting_work,
            air_energy=b.air_energy,
            entered=b.entered,
            left=b.left,
            work_given=b.work_given,
            work_received=b.work_received,
            blocks_kinetic=e.get("kinetic", 0.0),
            blocks_gravity=e.get("gravity", 0.0),
            **{name: e.get(name, 0.0) for name in STRUCTURE_LINES},
            driving_work=e.get("driving_work", 0.0),
            structure_residual=b.structure_residual,
            interface_residual=b.interface_residual if c.coupled else 0.0,
            input_energy=b.input_energy,
            energy_error=b.energy_error,
        )
        self._coupling.append(**{name: getattr(record, name) for name, *_ in COUPLING})
        self._append_momentum(record)
        if self._water:
            self._append_water(record)
        if self._air:
            self._append_air(record)
        if self._structure:
            self._append_structure(record)
        if self._gauges:
            values: dict[str, float | None] = {}
            for gauge in self._together():
                values |= gauge.read(c, record)
            self._gauges.append(time=record.time, **values)
            self.readings = values
        for gauge, table in self._own:
            for row in gauge.read(c, record):
                table.append(**row)
        if self.watch is not None:
            self.watch.step(c, record)
        if self.maps is not None:
            self.maps.step(c.water, record.time)

    def _append_momentum(self, record) -> None:
        m = record.momentum
        vectors = {"water": m.water, "blocks": m.blocks, **m.lines, "residual": m.residual}
        for table, part in ((self._momentum, slice(0, 3)), (self._angular, slice(3, 6))):
            row = {n: v for name, vector in vectors.items() for n, v in _xyz(name, vector[part]).items()}
            table.append(time=record.time, **row)

    def _append_water(self, record) -> None:
        w = self.coupling.water
        self.reinserted += abs(w.report.reinserted)
        self.reinserted_net += w.report.reinserted
        self.clipped += w.report.clipped
        self.left += w.report.left
        self.parted += w.report.bound.volume
        sides = w.sides
        self._water.append(
            time=record.time,
            volume=w.volume(),
            entered=0.0 if sides is None else sides.entered,
            left=self.left + (0.0 if sides is None else sides.left),
            volume_error=w.volume_error(),
            reinserted=self.reinserted,
            reinserted_net=self.reinserted_net,
            clipped=self.clipped,
            lowest_pressure=w.report.bound.lowest,
            wall_at_bound=w.report.bound.wall,
            parted=self.parted,
            **_xyz("momentum", w.momentum()),
        )

    def _append_air(self, record) -> None:
        air = self.coupling.water.air
        pressure = air.mean_pressure
        self._air.append(
            time=record.time,
            pockets=len(air),
            volume=float(self.coupling.water.pocket_volumes().sum()),
            reference=float(air.reference.sum()),
            largest_pressure=float(pressure.max(initial=0.0)),
            lowest_pressure=float(pressure.min(initial=0.0)),
            lost=air.lost,
            entrained=air.entrained,
            filled=air.gone,
            let_go=air.let_go,
        )

    def _append_structure(self, record) -> None:
        s = self.coupling.structure
        self.impulse += record.dt * record.load[: s.n, :3].sum(axis=0)
        joints = joint_counts(s)
        self._structure.append(
            time=record.time,
            joints_intact=joints.intact,
            joints_broken=joints.broken,
            largest_damage=joints.largest_damage,
            **_xyz("momentum", (s.mass[:, None] * s.velocity()[:, :3])[~s.fixed].sum(axis=0)),
            **_xyz("impulse", self.impulse),
            fastest=fastest_point(s.velocity(), self.coupling.radius),
        )

    def fields(self, time: float) -> None:
        """Write the present water, blocks and crack table."""
        c = self.coupling
        if self._fields:
            w = c.water
            self._fields.append(
                time,
                w.domain.nodes,
                w.domain.cells,
                {"level_set": w.level_set, "velocity": w.velocity, "pressure": w.pressure}
                | ({} if w.air is None else {"pocket": w.air.nodal(w.air.name)}),
                {"fluid_fraction": w.topology.fraction},
            )
        if self._blocks:
            s = c.structure
            data = {"speed": np.linalg.norm(s.velocity()[:, :3], axis=1)}
            data |= {} if s.joints is None else {"damage": block_damage(s)}
            data = {name: values[: self._n_blocks] for name, values in data.items()}
            self._blocks.append(time, s.centre()[: self._n_blocks], s.rotation()[: self._n_blocks], data)
        if self.watch is not None and c.water is not None:
            self.watch.look(c.water, time)
        if self.maps is not None:
            self.maps.write(self.history.parent / "maps")
        self._write_tables()
        self._written += 1

    def _write_tables(self) -> None:
        """Write the present tables of joints and blocks."""
        structure = self.coupling.structure
        if self.watch is not None:
            from coupler.results.damage_table import write_blocks

            write_blocks(self.each_block, structure, self.watch)
        if self.watch is not None and self.maps is not None:
            from coupler.results.buildings_table import write_buildings

            write_buildings(self.each_block.with_name("buildings.csv"), structure, self.watch, self.maps)
        cracks = crack_columns(structure) if structure else {}
        if cracks:
            write_cracks(self.cracks, cracks)
            corners, start = structure.joint_polygons()
            write_crack_surfaces(self.cracks.with_suffix(".vtu"), corners, start, cracks)

    def verdict(self) -> dict | None:
        """The present verdict on the structure (coupler/verdict/judge.py); None without one, or where no block
        moves freely: the question whether it stands has no meaning for driven blocks."""
        if self.watch is None or not self.watch.judged.any():
            return None
        from coupler.verdict.judge import verdict

        return verdict(self.coupling.structure, self.watch)

    def close(self) -> None:
        """Close all tables."""
        for table in self._tables.values():
            table.close()


def _below(start: str, kept) -> dict[str, Array]:
    """The arrays whose names begin with `start`, by the rest of the name."""
    return {name.removeprefix(start): a for name, a in kept.items() if name.startswith(start)}


def _xyz(name: str, vector) -> dict[str, float]:
    return {f"{name}_{axis}": float(v) for axis, v in zip("xyz", vector)}
