"""YADE's own laws: numbers matched to a joint, scenes described, and scripts that plain `yade` runs."""

import ast
import shutil
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from yade_scripts.blocks.block import Block
from yade_scripts.blocks.faces import FixedPlane, touching_faces
from yade_scripts.joints.cohesion import JointParameters
from yade_scripts.stock import cohfrict, cpm, jcfpm, mortar, scene
from yade_scripts.stock.script import (
    LAWS,
    ScriptFailed,
    UnknownStockLaw,
    read_table,
    run_script,
    script_text,
    stock_law,
    stock_names,
)

JOINTS = JointParameters(1e6, 1e-3, points=3, damping=0.0)
needs_yade = pytest.mark.skipif(shutil.which("yade") is None, reason="the command yade is not installed")

strengths = st.floats(1e3, 1e8)
failures = st.floats(1e-6, 1e-1)


def numbers(joints=JOINTS, friction=0.5):
    return scene.joint_numbers(joints, friction, 1.0)


def two_cubes(velocity, driven=True):
    return [
        Block("held", (0, 0, 0.5), size=1.0, fixed=True),
        Block("moved", (0, 0, 1.5), size=1.0, driven=driven, velocity=velocity),
    ]


def pulled(law, velocity, folder, end=0.02, records=400):
    """A joint of 1 m² opened at 10 mm/s."""
    blocks = two_cubes(velocity)
    described = scene.described(blocks, touching_faces(blocks), JOINTS, 2, 0.5, (0, 0, 0))
    law = stock_law(law)
    return run_script(law, scene.timed(described, law.variant, end, 5e-5, records), folder)


@pytest.mark.parametrize("law", [cohfrict, jcfpm, mortar], ids=lambda law: law.__name__)
@given(strength=strengths, failure=failures, area=st.floats(1e-4, 10.0))
def test_a_brittle_bond_has_the_stiffness_and_strength_of_the_joint(law, strength, failure, area):
    """Then its work T²/(2 K) is 2/27 T_max δ_f A: the price of matching K with a law that does not soften."""
    joint = numbers(JointParameters(strength, failure, damping=0.0))
    made = law.bond(area, joint)
    force = strength * area
    assert made["kn"] == pytest.approx(6.75 * strength / failure * area)
    assert force**2 / (2.0 * made["kn"]) == pytest.approx(2.0 / 27.0 * strength * failure * area)


@pytest.mark.parametrize("law", [cohfrict, jcfpm, mortar], ids=lambda law: law.__name__)
def test_the_variant_energy_has_the_work_of_separation_of_the_joint(law):
    made = law.bond(2.0, numbers(), "energy")
    assert (1e6 * 2.0) ** 2 / (2.0 * made["kn"]) == pytest.approx(2.0 * JOINTS.work_of_separation)


@given(strength=strengths, failure=failures)
@pytest.mark.parametrize("variant", ["exponential", "linear"])
def test_cpm_has_stiffness_strength_and_work_of_the_joint(variant, strength, failure):
    """Its traction T = E u to u_0, then (1 - ω) E u, integrated numerically; the tail of the exponential counts."""
    joints = JointParameters(strength, failure, damping=0.0)
    made = cpm.bond(1.0, numbers(joints), variant)
    u0, uf = made["onset"], made["end"]
    assert made["E"] * u0 == pytest.approx(strength)
    u = np.linspace(u0, uf if variant == "linear" else u0 + 40.0 * uf, 40001)
    if variant == "linear":
        left = 1.0 - (1.0 - u0 / u) / (1.0 - u0 / uf)
    else:
        left = u0 / u * np.exp(-(u - u0) / uf)
    work = 0.5 * strength * u0 + np.trapezoid(left * made["E"] * u, u)
    assert work == pytest.approx(joints.work_of_separation, rel=1e-4)


def test_an_exponential_cpm_bond_is_taken_out_at_the_share_of_strength_it_says():
    made = cpm.bond(1.0, numbers())
    kappa = made["onset"] - made["end"] * np.log(cpm.LEFT)
    left = made["onset"] / kappa * np.exp(-(kappa - made["onset"]) / made["end"])
    assert 1.0 - left == pytest.approx(made["damage"])
    assert left * made["E"] * kappa == pytest.approx(cpm.LEFT * JOINTS.strength)


@pytest.mark.parametrize(("opening", "left"), [(2e-3, 0.25), (-2e-3, 1.0)], ids=["tension", "compression"])
def test_the_energy_in_a_damaged_cpm_bond_is_half_of_force_times_opening(opening, left):
    """Three quarters of the stiffness are lost in tension, none in compression; shear keeps its stiffness."""
    kn, ks, sliding = 4e6, 3e6, 1e-3
    force, shear = np.array([left * kn * opening, 0.0, 0.0]), np.array([0.0, ks * sliding, 0.0])
    bond = SimpleNamespace(normalForce=force, shearForce=shear, omega=0.75, epsN=opening, kn=kn, ks=ks)
    expected = 0.5 * (abs(force[0] * opening) + ks * sliding**2)
    assert cpm.stored(bond) == pytest.approx(expected)


def test_lourenco_envelope_has_three_borders():
    """Tension cut-off, Coulomb line, compression cap; each by a stress just inside and just outside."""
    border = {"tension": 1.0, "cohesion": 1.5, "friction": 0.7, "compression": 6.0, "aspect": 1.2}
    for sigma, tau in ((1.0, 0.0), (0.0, 1.5), (-2.0, 2.9), (-6.0, 0.0), (0.0, 1.5)):
        assert mortar.inside(0.999 * sigma, 0.999 * tau, **border)
        assert not mortar.inside(1.001 * sigma, 1.001 * tau, **border)


def test_bonds_share_the_area_of_the_joint_and_touch_at_its_points():
    """Blocks of different size that overlap in part, and the ground: the same integration points as our joints."""
    blocks = [Block("a", (0, 0, 0.5), size=1.0), Block("b", (0.3, 0, 1.4), size=(1.0, 0.6, 0.8))]
    faces = touching_faces(blocks, [FixedPlane((0, 0, 0), (0, 0, 1))])
    described = scene.described(blocks, faces, JOINTS, 3, 0.5, (0, 0, -9.81))
    areas = np.bincount([p["joint"] for p in described["points"]], [p["area"] for p in described["points"]])
    assert areas == pytest.approx([f.area for f in faces])
    for p in described["points"]:
        face = faces[p["joint"]]
        assert (p["a"], p["b"]) == (face.a, max(face.b, -1))
        assert p["radius"] < scene.border_distance(face.polygon, np.array(p["place"]))


def test_spheres_stay_inside_their_blocks():
    """So blocks that do not touch, as diagonal neighbours, get no bond and no contact."""
    blocks = [Block(f"{i}{k}", (i, 0, k), size=1.0) for i in range(2) for k in range(2)]
    described = scene.described(blocks, touching_faces(blocks), JOINTS, 3, 0.5, (0, 0, 0))
    for p in described["points"]:
        for end, sign in (("a", -1.0), ("b", 1.0)):
            centre = np.array(p["place"]) + sign * p["radius"] * np.array(p["normal"])
            inside = 0.5 - np.abs(centre - blocks[p[end]].centre)
            assert inside.min() > p["radius"] * (1.0 - 1e-12)


def test_a_block_keeps_mass_and_inertia_in_its_principal_frame():
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    block = Block("b", (1, 2, 3), size=(1.0, 2.0, 3.0), rotation=turn)
    made = scene.described_block(block)
    w, x, y, z = made["orientation"]
    R = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    world = block.rotation @ block.inertia @ block.rotation.T
    assert R @ np.diag(made["inertia"]) @ R.T == pytest.approx(world)


@given(end=st.floats(1e-3, 10.0), substep=st.floats(1e-6, 1e-2), records=st.integers(1, 2000))
def test_records_are_whole_substeps_none_longer_than_asked(end, substep, records):
    made = scene.timed({"joint": {}}, "", end, substep, records)
    count = made["records"] * made["substeps_per_record"]
    assert count * made["substep"] == pytest.approx(end)
    assert made["substep"] <= max(substep, 0.0) * (1.0 + 1e-9) or count == 1


def test_names_are_refused_with_what_there_is():
    with pytest.raises(UnknownStockLaw, match="cohfrict"):
        stock_law("cofrict")
    with pytest.raises(UnknownStockLaw, match="no variant 'soft', but stiffness, energy"):
        stock_law("cohfrict:soft")


@pytest.mark.parametrize("name", stock_names())
def test_a_script_is_python_that_imports_yade_alone(name):
    """It must run in plain `yade`, where neither this project nor its packages are."""
    blocks = two_cubes((0, 0, 0.01))
    described = scene.described(blocks, touching_faces(blocks), JOINTS, 1, 0.5, (0, 0, 0))
    law = stock_law(name)
    tree = ast.parse(script_text(law, scene.timed(described, law.variant, 0.1, 1e-4, 10)))
    named = {n.module for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
    named |= {a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names}
    assert {n.partition(".")[0] for n in named} <= {"yade", "json", "math", "time"}
    assert {name.partition(":")[0] for name in stock_names()} == set(LAWS)


@needs_yade
@pytest.mark.parametrize("law", ["cohfrict", "jcfpm", "mortar"])
@pytest.mark.parametrize("velocity", [(0, 0, 0.01), (0.01, 0, 0)], ids=["pulled", "sheared"])
def test_a_brittle_bond_in_yade_breaks_at_the_strength(law, velocity, tmp_path):
    """Largest force T_max A within two records, work T_max²/(2 K_0) A; all bonds gone."""
    ran = pulled(law, velocity, tmp_path)
    record = ran.table["displacement"][1] * JOINTS.stiffness
    assert 0.0 < JOINTS.strength - ran.table["force"].max() < 2.0 * record
    assert ran.table["work"][-1] == pytest.approx(2.0 / 27.0 * 1e3, rel=0.03)
    assert ran.table["dissipated"][-1] == pytest.approx(ran.table["work"][-1])
    assert ran.table["joints_broken"][-1] == 1
    assert ran.figures["bonds"] == 4


@needs_yade
def test_cpm_in_yade_takes_the_work_of_the_joint(tmp_path):
    """Linear softening: E, T_max and G_c of the joint at once."""
    ran = pulled("cpm:linear", (0, 0, 0.01), tmp_path, end=0.13, records=650)
    assert ran.table["force"].max() == pytest.approx(JOINTS.strength, rel=0.01)
    assert ran.table["work"][-1] == pytest.approx(JOINTS.work_of_separation, rel=1e-3)


@needs_yade
def test_a_free_block_in_yade_keeps_momentum_and_energy(tmp_path):
    """Mass and inertia of the clump are those of the block, its bonds conserve energy: a glued cube set swinging."""
    blocks = two_cubes((0.005, 0.0, 0.005), driven=False)
    described = scene.described(blocks, touching_faces(blocks), JOINTS, 2, 0.5, (0, 0, 0))
    law = stock_law("cohfrict")
    ran = run_script(law, scene.timed(described, law.variant, 0.02, 1e-5, 50), tmp_path)
    energy = ran.table["kinetic"] + ran.table["stored"]
    assert ran.table["kinetic"][0] == pytest.approx(0.5 * 2400.0 * 2 * 0.005**2)
    assert energy == pytest.approx(energy[0], rel=0.02)  # leapfrog: half a step between the two


@needs_yade
def test_a_script_that_fails_says_where(tmp_path):
    law = stock_law("cohfrict")
    with pytest.raises(ScriptFailed, match=r"cohfrict\.py"):
        run_script(law, {"blocks": []}, tmp_path)


def test_a_table_is_read_by_its_names(tmp_path):
    (tmp_path / "t.csv").write_text("a,b\n1,2\n3,4\n", encoding="utf-8")
    table = read_table(tmp_path / "t.csv")
    assert table["b"].tolist() == [2.0, 4.0]
