"""Records of inflows and tides: their files, those of other programs among them, and what comes in by them."""

import numpy as np
import pytest

from coupler.case.inflow_records import RecordError, record_of
from coupler.case.water import RecordInflow
from coupler.scene.build_water import sea_level
from fluid.sides.waves import record_along
from tests.coupler.water_cases import case, reported, run


def read(path, side="x-", turn=0.0, **keys):
    return record_of(RecordInflow(kind="record", side=side, path=str(path), **keys), turn)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("time,level\n0,1\n", 'no column velocity.*levels alone write velocity = "long-wave"'),
        ("time,level,velocity\n0,1\n", "r.csv:2: 2 values; every line needs 3"),
        ("time,level,velocity\n1,1,0\n0,1,0\n", "r.csv:3: times must increase; 0 s comes after 1 s"),
        ("# a\n\ntime,level,velocity\n0,a,0\n", "r.csv:4: 'a' is not a number"),
        ("time,level,velocity\n0,,0\n", "r.csv:2: '' is not a number"),
        ("time,level,velocity\n0,nan,0\n", "r.csv:2: '0,nan,0' is not finite"),
        ("time,level,velocity\n", "no line of numbers"),
        ("time;level;velocity\n0;1;0\n", "no column time, level, velocity"),
        ("", "no column"),
    ],
)
def test_records_that_cannot_be_read_say_why(tmp_path, text, says):
    path = tmp_path / "r.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RecordError, match=says):
        read(path)


def test_a_record_that_is_not_there_names_the_nearest_file(tmp_path):
    (tmp_path / "bore.csv").write_text("time,level,velocity\n0,1,0\n", encoding="utf-8")
    with pytest.raises(RecordError, match=r"no such file; did you mean 'bore.csv'"):
        read(tmp_path / "Bore.csv")


def test_a_record_saved_by_a_spreadsheet_may_begin_with_a_byte_order_mark(tmp_path):
    path = tmp_path / "r.csv"
    path.write_bytes("time,level,velocity\r\n0,1,0\r\n1,2,0\r\n".encode("utf-8-sig"))
    assert list(read(path).level[:, 0]) == [1, 2]


def test_columns_of_a_record_may_stand_in_any_order(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text("# a wave\nlevel, velocity, time\n1.0, 2.0, 0\n1.5, 2.5, 3\n", encoding="utf-8")
    found = read(path)
    assert (list(found.time), list(found.level[:, 0]), list(found.velocity[:, 0])) == (
        [0, 3],
        [1, 1.5],
        [2, 2.5],
    )


GEOCLAW = """# gauge_id=   101 location=(   3.8823000000E+05   4.2530500000E+06 ) num_var=  4
# Stationary gauge
# level, time, q[  1  2  3], eta, aux[]
# file format ascii, time series follow in this file
 1 0.0E+00 2.0E+00  0.0E+00  0.0E+00  5.0E-01
 1 1.0E+01 2.5E+00  5.0E+00  2.5E+00  1.0E+00
 2 1.0E+01 2.5E+00  5.0E+00  1.0E+00  1.0E+00
 2 2.0E+01 0.0E+00  1.0E-09  0.0E+00 -1.5E+00
"""

OLD_GEOCLAW = (
    "##  gauge name  101 gauge number  1 loc  0.0E+00 0.0E+00\n##  level time  dependent vars 1 ... nvar\n"
)


@pytest.mark.parametrize("head", [GEOCLAW, OLD_GEOCLAW + "".join(GEOCLAW.splitlines(True)[4:])])
def test_gauge_of_geoclaw_is_a_record(tmp_path, head):
    """Depth and momenta over the axes of the file; a time written on two levels counts once; dry is at rest."""
    path = tmp_path / "gauge00101.txt"
    path.write_text(head)
    found = read(path, start=5.0, zero=0.5)
    np.testing.assert_allclose(found.time, [-5, 5, 15])
    np.testing.assert_allclose(found.level[:, 0], [0, 0.5, -2])
    np.testing.assert_allclose(found.velocity[:, 0], [0, 2, 0])
    np.testing.assert_allclose(found.sideways[:, 0], [0, 0.4, 0])
    np.testing.assert_allclose(read(path, side="x+").velocity[:, 0], [0, -2, 0])
    np.testing.assert_allclose(read(path, side="y-").velocity[:, 0], [0, 0.4, 0])
    turned = read(path, turn=np.pi / 2)  # x of the file lies along y of the tank
    np.testing.assert_allclose([turned.velocity[1, 0], turned.sideways[1, 0]], [-0.4, 2])


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("Stationary gauge", "Lagrangian particle, q[2,3] replaced by (x(t),y(t))", "stationary one is needed"),
        ("format ascii", "format binary64", "write gauges as ascii"),
        ("q[  1  2  3]", "q[  1]", r"it holds q\[1\]"),
        (" 2 2.0E+01", " 2 2.0E+00", "times run back"),
        (" 5.0E-01\n", "\n", "gauge.txt:5: 5 values"),
    ],
)  # fmt: skip
def test_gauge_of_geoclaw_that_is_no_record_is_refused(tmp_path, old, new, says):
    path = tmp_path / "gauge.txt"
    path.write_text(GEOCLAW.replace(old, new))
    with pytest.raises(RecordError, match=says):
        read(path)


def thetis(path, fields=("uv_2d", "elev_2d"), dims=(2, 1), names=("north", "south")):
    import h5py

    with h5py.File(path, "w") as file:
        file["time"] = np.array([[0.0], [10.0]])
        for k, name in enumerate(names):
            file[name] = np.array([[0.0, 0.0, 0.0], [1.0 + k, 0.5, 2.0]])[:, 3 - sum(dims) :]
        file.attrs["field_names"] = np.array(fields, "S")
        file.attrs["field_dims"] = dims
    return path


def test_detector_of_thetis_is_a_record(tmp_path):
    path = thetis(tmp_path / "diagnostic_coast.hdf5")
    found = read(path, gauge="south")
    assert (list(found.level[:, 0]), list(found.velocity[:, 0]), list(found.sideways[:, 0])) == (
        [0, 2],
        [0, 2],
        [0, 0.5],
    )
    with pytest.raises(RecordError, match="several detectors, north, south; name one"):
        read(path)
    with pytest.raises(RecordError, match="no detector 'nort'; did you mean 'north'"):
        read(path, gauge="nort")
    with pytest.raises(RecordError, match="no field uv_2d; they have elev_2d"):
        read(thetis(tmp_path / "b.h5", ("elev_2d",), (1,), ("a",)))


def test_levels_alone_come_in_as_a_long_wave(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text("time,level\n0,0\n10,0.5\n")
    spec = RecordInflow(kind="record", side="x-", path=str(path), velocity="long-wave")
    found = record_of(spec, bed=-2.0)
    assert found.velocity[1, 0] == pytest.approx(2 * np.sqrt(9.81) * (np.sqrt(2.5) - np.sqrt(2.0)))
    with pytest.raises(RecordError, match="no column velocity"):
        read(path)


def test_record_along_a_side(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text("time,along,level,velocity,sideways\n0,0,1,0,0\n0,5,1,0,0\n2,0,2,4,1\n2,5,1,2,0\n")
    found = read(path)
    assert found.varies
    assert found.level_at(1.0) == 1.25
    flow = record_along((1, 0, 0), found.time, found.along, found.level, found.velocity, found.sideways)
    points = np.array([[0, 0, 0], [0, 2.5, 0], [0, 9, 0.0]])
    np.testing.assert_allclose(flow.level_at(points, 2.0), [2, 1.5, 1])
    np.testing.assert_allclose(flow.velocity(points, 1.0), [[2, 0.5, 0], [1.5, 0.25, 0], [1, 0, 0]])
    path.write_text("time,along,level,velocity\n0,0,1,0\n0,5,1,0\n2,0,2,4\n2,6,1,2\n")
    with pytest.raises(RecordError, match="expected 5 m, got 6 m"):
        read(path)
    path.write_text("time,along,level,velocity\n0,0,1,0\n0,5,1,0\n2,0,2,4\n")
    with pytest.raises(RecordError, match="every time needs the same 2 places"):
        read(path)


TIDE = {"side": "x+", "level": 0.5}


def test_tide_of_a_sea(tmp_path):
    from coupler.case.water import Sea

    level = sea_level(Sea(**TIDE, tide={"amplitude": 0.2, "period": 40, "high": 10}))
    np.testing.assert_allclose([level(t) for t in (0, 10, 20, 30)], [0.5, 0.7, 0.5, 0.3], atol=1e-12)
    (tmp_path / "tide.csv").write_text("time,level\n0,0.5\n100,1.5\n")
    level = sea_level(Sea(**TIDE, tide={"path": str(tmp_path / "tide.csv")}))
    assert level(50.0) == 1.0


@pytest.mark.parametrize(
    ("tide", "says"),
    [
        ({}, "write amplitude and period, or path"),
        ({"amplitude": 0.1}, "write amplitude and period, or path"),
        ({"amplitude": 0.6, "period": 1}, "its level varies from z = -0.1"),
        ({"path": "/nowhere/tide.csv"}, "no such file"),
    ],
)
def test_tide_that_cannot_be_is_refused(tide, says):
    assert any(says in line for line in reported({"sea": [{**TIDE, "tide": tide}]}))


@pytest.mark.parametrize("absorbs", [False, True])
def test_water_follows_a_slow_tide_and_its_volume_adds_up(absorbs):
    """A basin of 2 m beside a sea that rises by 0.1 m in 10 s: waves cross it ten times in that."""
    tide = {"amplitude": 0.05, "period": 20.0, "high": 10.0}
    sea = {"side": "x+", "level": 0.55, "tide": tide, "absorbs": absorbs}
    found = case({"sea": [sea]}, time={"end": 10.0}, gauge=[{"name": "g", "kind": "level", "at": [1.0, 0.1]}])
    coupling, _, rows = run(found, 10.0)
    water = coupling.water
    assert rows[-1]["g_level"] == pytest.approx(0.6, abs=0.005)
    brought = water.sides.entered - water.sides.left
    assert water.volume() == pytest.approx(2 * 0.2 * 0.5 + brought, rel=1e-6)
    assert water.volume() == pytest.approx(2 * 0.2 * 0.6, rel=0.01)
