"""From [sweep] to its runs: grids, tables, samples, repeats, links, and every mistake reported before the first run."""

import numpy as np
import pytest

from coupler.checks.read_case import load
from coupler.commands.sweep.plan import make_plan
from coupler.program.errors import BadCall, BadCase
from yade_scripts.joints import outside_laws

from .arm import CASE

WATER = """\
[case]
title = "a wave without and with a box"
[time]
end = 1
[tank]
lower = [0, 0, 0]
upper = [4, 1, 2]
cell = 0.25
[[water.fill]]
lower = [0, 0, 0]
upper = [1, 1, 1]
[structure]
[[structure.block]]
name = "box"
size = [0.5, 0.5, 0.5]
centre = [3, 0.5, 0.25]
[contact]
stiffness = 1e6
[[gauge]]
kind = "force"
name = "box"
on = "box"
[[gauge]]
kind = "level"
name = "front"
at = [2, 0.5]
"""


@pytest.fixture
def case(tmp_path):
    def make(sweep="", text=CASE, files=None):
        (tmp_path / "case.toml").write_text(text + sweep, encoding="utf-8")
        for name, content in (files or {}).items():
            (tmp_path / name).write_text(content, encoding="utf-8")
        return tmp_path

    return make


def values(plan, name):
    return [row.values[name] for row in plan.rows]


def test_lists_and_grids_are_crossed_and_in_si(case):
    plan = make_plan(
        case(
            """
[[sweep.vary]]
key = "joints.strength"
values = ["0.5 MPa", 1e6]
[[sweep.vary]]
name = "speed"
key = "structure.block[1].velocity[0]"
low = "10 cm/s"
high = "1 m/s"
steps = 3
spacing = "log"
"""
        )
    )
    assert values(plan, "strength") == [5e5, 5e5, 5e5, 1e6, 1e6, 1e6]
    assert values(plan, "speed") == pytest.approx([0.1, 0.1**0.5, 1.0] * 2)
    assert [c.unit for c in plan.columns] == ["Pa", "m/s"]
    assert len(plan.runs) == 6
    for row in plan.rows:
        found = load(plan.file.path, plan.runs[row.id]).case
        assert found.joints.strength == row.values["strength"]
        assert found.structure.block[1].velocity[0] == pytest.approx(row.values["speed"])


def test_vary_of_the_command_line_reads_lists_grids_and_distributions(case):
    plan = make_plan(case(), ["joints.strength=0.5 MPa, 1 MPa", "time.end=10 ms:20 ms:2"])
    assert values(plan, "strength") == [5e5, 5e5, 1e6, 1e6]
    assert values(plan, "end") == pytest.approx([0.01, 0.02] * 2)
    plan = make_plan(
        case("[sweep]\nsamples = 200\n"), ["joints.strength=lognormal(median=0.5 MPa, dispersion=0.2)"]
    )
    logs = np.log(values(plan, "strength"))
    assert logs.mean() == pytest.approx(np.log(5e5), abs=1e-3)  # a Latin hypercube is that even
    assert logs.std() == pytest.approx(0.2, rel=0.01)


def test_vary_takes_the_place_of_the_table_with_its_key(case):
    place = case('[[sweep.vary]]\nkey = "joints.strength"\nvalues = [1e6]\n')
    assert values(make_plan(place, ["joints.strength=2 MPa"]), "strength") == [2e6]


def test_a_table_gives_the_points_with_units_and_names_for_formulas(case):
    plan = make_plan(
        case(
            """
[sweep]
table = "points.csv"
[[sweep.link]]
key = "joints.opening_at_failure"
formula = "opening * joints.strength / 1e6"
""",
            files={
                "points.csv": "# made by hand\njoints.strength [MPa], opening [m]\n0.5, 0.002\n1, 0.003\n"
            },
        )
    )
    assert values(plan, "strength") == [5e5, 1e6]
    cases = [load(plan.file.path, plan.runs[row.id]).case for row in plan.rows]
    assert [c.joints.opening_at_failure for c in cases] == pytest.approx([0.001, 0.003])


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (
            'formula = "slid > 0.05"',
            "slid > 0.05 is neither a number, a name nor an operation (+ - * / **); functions: sqrt",
        ),
        ('formula = "slid *"', "'slid *': not a formula"),
        ('formula = "abs(slid)"', "abs(slid) is neither a number"),
        ('formula = "(slid).real"', "there is no 'slid.real'"),
        ('formula = "(2 * slid).real"', "(2 * slid).real is neither a number"),
        ('formula = "later / 2"', "there is no 'later'"),
        (
            'formula = "slip / 2"',
            "there is no 'slip'; did you mean 'slid'?; without table a formula takes names of the",
        ),
        (
            'formula = "slid / joints.strenght"',
            "there is no 'joints.strenght'; did you mean 'joints.strength'?",
        ),
        ('table = "history/gauges.csv"\nformula = "value >= 2"', "value >= 2 is neither a number"),
    ],
)
def test_a_bad_formula_is_refused_when_the_case_is_read(case, given, says):
    """It was found when the table was written, after the last run."""
    place = case(
        f"""
[[sweep.vary]]
key = "joints.strength"
values = ["0.5 MPa", "1 MPa"]
[[sweep.quantity]]
name = "slid"
figure = "largest_water_force"
[[sweep.quantity]]
name = "far"
{given}
[[sweep.quantity]]
name = "later"
figure = "joints"
"""
    )
    with pytest.raises(BadCase) as reported:
        load(place)
    assert "sweep.quantity[1].formula" in str(reported.value)
    assert says in str(reported.value)


def test_formulas_take_columns_of_the_sweep_and_names_of_the_case(case):
    text = """
[sweep]
seeds = ["joints.seed"]
[[sweep.vary]]
key = "joints.strength"
values = ["0.5 MPa", "1 MPa"]
[[sweep.quantity]]
name = "force"
figure = "largest_water_force"
[[sweep.quantity]]
name = "share"
formula = "force / strength + structure.block[0].size[2] * joints.strength + sqrt(run * repeat - joints_seed) / end"
"""
    place = case(text)
    assert load(place).case.sweep.quantity[1].name == "share"
    with pytest.raises(BadCase, match=r"quantity\[1\].formula: .*there is no 'end'"):
        make_plan(place)
    assert len(make_plan(place, ["time.end=10 ms,20 ms"]).runs) == 4


DRAWN = """
[sweep]
sample = "{sample}"
samples = {samples}
repeats = 2
seeds = ["joints.seed"]
[[sweep.vary]]
key = "time.end"
values = {ends}
[[sweep.vary]]
key = "joints.strength"
distribution = "weibull"
mean = "1 MPa"
variation = 0.3
"""


def test_a_longer_list_leaves_the_other_runs_as_they_are(case):
    short = make_plan(case(DRAWN.format(sample="latin", samples=4, ends="[0.01, 0.03]")))
    long = make_plan(case(DRAWN.format(sample="latin", samples=4, ends="[0.01, 0.02, 0.03]")))
    assert len(short.rows) == 16
    assert set(short.runs) < set(long.runs)
    assert len(long.runs) == 24


BOX = """\
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 {h}\nv 1 0 {h}\nv 1 1 {h}\nv 0 1 {h}
f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8
"""
OF_FILE = """\
[case]
title = "a block from a file"
[time]
end = 1
[structure]
[[structure.file]]
path = "box.obj"
[contact]
stiffness = 1e6
[[sweep.vary]]
key = "contact.friction"
values = [0.3, 0.5]
"""


def test_another_content_of_a_file_makes_other_runs(case):
    """Else a call after the file was changed would report the runs of the old one."""
    first = make_plan(case(text=OF_FILE, files={"box.obj": BOX.format(h=1)}))
    other = make_plan(case(text=OF_FILE, files={"box.obj": BOX.format(h=2.5)}))
    again = make_plan(case(text=OF_FILE, files={"box.obj": BOX.format(h=1)}))
    assert set(first.runs) == set(again.runs)
    assert not set(first.runs) & set(other.runs)


LAW = """\
from numba import njit
from surgebreak import CohesiveLaw
@njit
def secant(r, peak):
    return 6.75 * (1.0 - r) ** 2
@njit
def work(r, peak):
    return 6.75 * r * r * (0.5 - 2.0 * r / 3.0 + 0.25 * r * r)
LAW = CohesiveLaw(secant, work, peak=1 / 3, lowest_peak=1 / 3, highest_peak=1 / 3, points={points})
"""


def test_another_law_of_the_same_name_makes_other_runs(case, tmp_path, monkeypatch):
    for name in ("_registered", "_origins", "_files"):
        monkeypatch.setattr(outside_laws, name, {})
    monkeypatch.setenv(outside_laws.VARIABLE, "")
    text = CASE.replace("[joints]", '[joints]\nlaw = "own"')
    vary = '[[sweep.vary]]\nkey = "joints.strength"\nvalues = [1e6, 2e6]\n'
    made = []
    for points in (3, 5):
        place = tmp_path / str(points) / "own.py"
        place.parent.mkdir()
        place.write_text(LAW.format(points=points), encoding="utf-8")
        outside_laws.register_file(place)
        made.append(set(make_plan(case(text=text, sweep=vary)).runs))
        outside_laws._files.clear()
    assert len(made[0]) == len(made[1]) == 2
    assert not made[0] & made[1]


def test_more_samples_of_sobol_points_leave_the_first_runs_as_they_are(case):
    few = make_plan(case(DRAWN.format(sample="sobol", samples=4, ends="[0.01]")))
    many = make_plan(case(DRAWN.format(sample="sobol", samples=8, ends="[0.01]")))
    assert set(few.runs) < set(many.runs)


def test_every_run_has_seeds_of_its_own_and_always_the_same(case):
    place = case(DRAWN.format(sample="latin", samples=4, ends="[0.01, 0.03]"))
    seeds = [row.seeds["joints.seed"] for row in make_plan(place).rows]
    assert len(set(seeds)) == 16
    assert [row.seeds["joints.seed"] for row in make_plan(place).rows] == seeds
    point = values(make_plan(place), "strength")
    assert point[0:8:2] == point[1:8:2]  # the repeats of a sample
    assert point[:8] != point[8:]  # samples of another point are others


@pytest.mark.parametrize(
    ("ends", "wanted"),
    [
        ("low = 1\nhigh = 6", range(1, 7)),
        ("low = 0.5\nhigh = 6.5", range(1, 7)),
        ("low = 1\nhigh = 60\nlower = 4\nupper = 6.2", range(4, 7)),
        ("low = -2\nhigh = 3", range(-2, 4)),
    ],
)
def test_whole_numbers_of_a_uniform_distribution_are_equally_likely(case, ends, wanted):
    """Exactly so with a Latin hypercube; rounded, the numbers at both ends had half as many samples."""
    plan = make_plan(
        case(
            f'[sweep]\nsamples = 60\n[[sweep.vary]]\nname = "n"\ndistribution = "uniform"\nwhole = true\n{ends}\n'
        )
    )
    drawn, count = np.unique(values(plan, "n"), return_counts=True)
    assert drawn.tolist() == list(wanted)
    assert (count == 60 // len(wanted)).all()


def test_a_uniform_distribution_without_a_whole_number_is_refused(case):
    sweep = (
        '[sweep]\n[[sweep.vary]]\nname = "n"\ndistribution = "uniform"\nwhole = true\nlow = 1.2\nhigh = 1.8\n'
    )
    with pytest.raises(BadCase, match=r"sweep.vary n: there is no whole number from 1.2 to 1.8"):
        make_plan(case(sweep))


FREE_DEPTH = """
[[sweep.vary]]
name = "depth"
key = "water.fill[0].upper[2]"
values = [0.8, 1.2]
[[sweep.quantity]]
name = "flow"
table = "history/gauges.csv"
column = "front_level"
take = "max"
source = "free field"
"""


def test_the_free_field_is_made_once_for_all_that_differ_in_the_structure(case):
    plan = make_plan(
        case(
            """
[[sweep.vary]]
name = "density"
key = "structure.block[0].density"
values = [500, 600, 700]
"""
            + FREE_DEPTH,
            text=WATER.replace("centre = [3", "density = 500\ncentre = [3"),
        )
    )
    free = list(dict.fromkeys(row.free for row in plan.rows))
    assert len(plan.runs) == 8
    assert list(plan.runs)[:2] == free[::-1] or set(list(plan.runs)[:2]) == set(free)
    for id in free:
        found = load(plan.file.path, plan.runs[id]).case
        assert found.structure is None
        assert [gauge.name for gauge in found.gauge] == ["front"]


def test_the_free_field_leaves_out_all_that_is_about_the_structure(case):
    """A verdict, cracks of joints and cells that are finer around a block: each was refused without the blocks."""
    text = WATER.replace("[[water.fill]]", '[water]\ncracks = "slit"\n[[water.fill]]').replace(
        "cell = 0.25",
        """cell = 0.25
refine = [
    { around = ["box"], levels = 1 },
    { around = ["pier", "box"], levels = 1 },
    { around = ["blocks", "pier"], levels = 1 },
]""",
    )
    more = """
[joints]
strength = 1e6
opening_at_failure = 0.01
[verdict]
on = ["box"]
[[solid]]
name = "pier"
centre = [3.5, 0.5, 0.25]
size = [0.2, 0.2, 0.5]
"""
    plan = make_plan(case(FREE_DEPTH, text=text + more))
    assert [row.wrong for row in plan.rows] == ["", ""]
    found = load(plan.file.path, plan.runs[plan.rows[0].free]).case
    assert found.structure is None
    assert [region.around for region in found.tank.refine] == [("pier",), ("blocks", "pier")]


def test_what_is_wrong_without_the_structure_alone_says_so(case):
    sweep = '[sweep]\nfree_field = ["tank.cell=-1"]\n' + FREE_DEPTH
    with pytest.raises(BadCase, match=r"tank\.cell.*in the run without structure; sweep\.free_field"):
        make_plan(case(sweep, text=WATER))


def test_rows_that_are_no_case_are_reported_and_the_rest_is_run(case):
    plan = make_plan(case('[[sweep.vary]]\nkey = "time.end"\nvalues = [0.01, -1]\n'))
    assert [bool(row.wrong) for row in plan.rows] == [False, True]
    assert "time.end" in plan.rows[1].wrong
    assert len(plan.runs) == 1
    assert "1 of 2 rows are no case" in plan.remarks[0]
    with pytest.raises(BadCase, match=r"time\.end"):
        make_plan(case('[[sweep.vary]]\nkey = "time.end"\nvalues = [-2, -1]\n'))


def test_nothing_varied_is_refused(case):
    with pytest.raises(BadCase, match="nothing is varied"):
        make_plan(case())


@pytest.mark.parametrize(
    ("sweep", "says"),
    [
        ('[[sweep.vary]]\nkey = "joints.strenght"\nvalues = [1]', "did you mean 'joints.strength'"),
        ('[[sweep.vary]]\nkey = "limits.cpu_seconds"\nvalues = [1, 2]', "sweep.cpu_seconds takes its place"),
        ('[sweep]\nset = ["limits.cpu_seconds=9"]', "sweep.cpu_seconds takes its place"),
        ('[[sweep.vary]]\nkey = "joints.strength"\nvaluse = [1]', "did you mean 'values'"),
        ('[[sweep.vary]]\nkey = "joints.strength"', "give one of values, steps"),
        ('[[sweep.vary]]\nkey = "joints.strength"\nvalues = [1]\nsteps = 2', "give one of values, steps"),
        (
            '[[sweep.vary]]\nkey = "joints.strength"\ndistribution = "lognormal"\nmean = 1',
            "median and dispersion",
        ),
        (
            '[[sweep.vary]]\nkey = "joints.strength"\ndistribution = "normal"\nmean = "1 m"\ndeviation = 1',
            "is a length, needs a pressure",
        ),
        ('[[sweep.vary]]\nkey = "joints"\nvalues = [1]', "no such name"),
        ('[[sweep.vary]]\nkey = "sweep.samples"\nvalues = [1]', "takes no notice"),
        ('[[sweep.vary]]\nkey = "time.end"\nname = "water"\nvalues = [1]', "'water' is taken by a section"),
        (
            '[[sweep.vary]]\nkey = "time.end"\nname = "id"\nvalues = [1]',
            "'id' is taken by a column of every table",
        ),
        ('[sweep]\nrepeats = 2\n[[sweep.vary]]\nkey = "time.end"\nvalues = [1]', "the same run each time"),
        ('[sweep]\nsamples = 2\n[[sweep.vary]]\nkey = "time.end"\nvalues = [1]', "no distribution"),
        ('[sweep]\nsample = "saltelli"\n[[sweep.vary]]\nkey = "time.end"\nvalues = [1]', "two distributions"),
        ('[sweep]\nseeds = ["joint.seed"]\n', "did you mean 'joints.seed'"),
        ('[[sweep.quantity]]\nname = "a"\ntable = "history/gauges.csv"', "give one of table with column"),
        ('[[sweep.quantity]]\nname = "a"\ndamage = "drift"', "needs lower and upper"),
        ('[[sweep.quantity]]\nname = "a"\nfigure = "time"\ntake = "max"', "for the columns of a table"),
        (
            '[[sweep.fragility]]\nname = "f"\nmeasure = "dpeth"\nstate=[{name = "s", quantity = "time", at_least = 1}]',
            "there is no 'dpeth'",
        ),
        (
            '[[sweep.fragility]]\nname = "f"\nmeasure = "time"\nstate=[{name="s", quantity="joint", at_least=1}]',
            "did you mean 'joints'",
        ),
        (
            '[sweep]\nsensitivity = ["time"]\n[[sweep.vary]]\nkey = "time.end"\nvalues = [1]',
            "no distribution",
        ),
        ('[sweep]\nkeep = "some"', "keep"),
    ],
)
def test_mistakes_are_reported_with_file_and_key(case, sweep, says):
    with pytest.raises(BadCase) as reported:
        make_plan(case("\n" + sweep))
    assert says in str(reported.value)
    assert "sweep" in str(reported.value)
    assert "case.toml" in str(reported.value)


@pytest.mark.parametrize(
    ("vary", "says"),
    [
        ("joints.strength", "write KEY=A,B"),
        ("joints.strength=lognormal(0.1 MPa)", "write NAME=NUMBER"),
        ("joints.strength=lognorm(median=1, dispersion=1)", "did you mean 'lognormal'"),
        ("joints.strength=normal(mean=1, dispersion=1)", "is given by mean and deviation"),
        ("joints.strength=0.1,0.2 MPa", "0.1 has no unit, which means SI, but '0.2 MPa' has one"),
        ("joints.strength=0.1 MPa:0.5:5", "write the unit at every value"),
        ("joints.strenght=1,2", "did you mean 'joints.strength'"),
        ("joints.strength=1 MPa:2 MPa", "a grid is FROM:TO:STEPS"),
        ("joints.strength=1 MPa:2 MPa:2.5", "a grid is FROM:TO:STEPS"),
    ],
)
def test_mistakes_of_vary_name_it(case, vary, says):
    with pytest.raises(BadCall) as reported:
        make_plan(case(), [vary])
    assert str(reported.value).startswith(f"--vary {vary}: ")
    assert says in str(reported.value)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("joints.strength\n", "a line of names and a line for each"),
        ("joints.strength,time.end\n1\n", "points.csv:2: 1 cells under 2 names"),
        ("joints.strenght\n1\n", "did you mean 'joints.strength'"),
        ("joints.strength,time.end\n1,\n", "an empty cell"),
        ("time.end,tank.end\n1,2\n", "no such name"),
    ],
)
def test_mistakes_in_a_table_name_its_line(case, text, says):
    with pytest.raises(BadCase) as reported:
        make_plan(case('[sweep]\ntable = "points.csv"\n', files={"points.csv": text}))
    assert says in str(reported.value)


def test_a_run_takes_no_notice_of_the_section(case):
    from coupler.case.case import effective

    plain = effective(load(case()).case)
    assert effective(load(case(DRAWN.format(sample="latin", samples=4, ends="[0.01]"))).case) == plain


def test_a_varied_friction_that_a_preset_replaces_is_told_before_the_runs(case):
    """All rows would give the same numbers, and a fragility curve would show no scatter."""
    text = WATER.replace("centre = [3, 0.5, 0.25]", 'centre = [3, 0.5, 0.25]\nmaterial = "concrete"')
    vary = '[[sweep.vary]]\nkey = "contact.friction"\nvalues = [0.3, 0.4]\n'
    (remark,) = make_plan(case(vary, text=text)).remarks
    assert remark.startswith("what is varied may have no effect: contact.friction = 0.3 does not apply")
    assert not make_plan(case(vary, text=WATER)).remarks
    other = vary.replace("contact.friction", "contact.restitution")
    assert not make_plan(case(other, text=text)).remarks
