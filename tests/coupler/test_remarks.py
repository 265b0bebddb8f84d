"""What is allowed in a case, but told before the run."""

import pytest

from coupler.checks.remarks import remarks
from coupler.checks.thin_walls import thin_remarks
from coupler.geometry.tank_mesh import measured
from tests.coupler.checked_case import case, reported, structure

QUAY = {"name": "quay", "centre": [30.3, 4, 3], "size": [1.2, 8, 6]}
FINE_BOX = {"refine": [{"lower": [0, 0, 0], "upper": [3, 8, 2], "levels": 2}]}


@pytest.mark.parametrize(
    ("changes", "remarked"),
    [
        ({}, True),
        ({"contact": {"stiffness": 1e9, "pair": [{"materials": ["block", "tank"], "friction": 0}]}}, False),
        ({"joints": {"strength": 1e5, "opening_at_failure": 1e-3}}, False),
        (
            {
                "joints": {"strength": 1e5, "opening_at_failure": 1e-3},
                "tank": {"lower": [0, 0, 0], "upper": [4, 1, 3], "cell": 0.5, "smooth": ["y-", "y+"]},
            },
            True,
        ),
        ({"tank": {"lower": [0, 0, 0], "upper": [4, 2, 3], "cell": 0.5}}, False),
        ({"tank": {"lower": [0, 0, 0], "upper": [4, 1, 3], "cell": 0.5, "open": ["z+", "y+"]}}, False),
    ],
    ids=["a slice", "no friction", "joined", "joined between symmetry planes", "a gap", "an open side"],
)
def test_blocks_from_side_to_side_of_a_slice_are_remarked(changes, remarked):
    """Their friction on the sides carries a load that a longer wall does not have, and kept one standing; a glued wall
    that has broken from its foot bends between symmetry planes."""
    wall = {"name": "w", "lower": [2, 0, 0], "size": [0.5, 1, 2], "block": [0.5, 0.5, 0.5]}
    tank = {"lower": [0, 0, 0], "upper": [4, 1, 3], "cell": 0.5}
    made = case(**{"structure": {"wall": [wall]}, "contact": {"stiffness": 1e9}, "tank": tank} | changes)
    found = [text for text in remarks(made) if "rub on both sides" in text]
    assert bool(found) == remarked
    if remarked:
        assert "reach from y- to y+ of the tank and rub on both sides, with friction 0.5" in found[0]
        assert found[0].endswith(
            'materials = ["block", "tank"], friction = 0, and [structure.ground] for that of the floor'
        )


@pytest.mark.parametrize(
    ("place", "more", "remarked"),
    [
        ([3, 5, 1], {}, True),
        ([8, 5, 1], {}, False),
        ([3, 5, 8], {}, False),
        ([3, 5, 1], {"joints": {"strength": 1e5, "opening_at_failure": 1e-3}}, False),
        ([3, 5, 1], {"water": None}, False),
    ],
    ids=["in water", "beside it", "above it", "joined", "no water"],
)
def test_loose_blocks_in_water_without_their_weight_are_remarked(place, more, remarked):
    """A dry arch under water came apart in the first tenth of its ramp, and stands with its weight from the start."""
    blocks = structure({"centre": place, "size": [2, 2, 2]})
    blocks["structure"] |= {"start": "ramp", "ramp": 1.0}
    found = [text for text in remarks(case(**blocks | more)) if "start = 'ramp'" in text]
    assert bool(found) == remarked


def test_walls_thinner_than_a_cell_are_remarked():
    """Single covers lose load on walls thinner than a cell; allowed, but not in silence."""
    thin = {"centre": [7, 5, 1], "size": [0.2, 2, 2]}
    assert remarks(case(**structure({"centre": [7, 5, 0.5]}))) == []
    assert remarks(case(**structure(thin)))[0].startswith("b0 is 0.2 m thick, thinner than a cell (1 m)")
    wall = {"name": "w", "lower": [6, 2, 0], "size": [1.4, 4, 2], "block": [1.4, 2, 1]}
    found = [
        text
        for text in remarks(case(structure={"wall": [wall]}, contact={"stiffness": 1e8}))
        if "thin" in text
    ]
    assert found[0].startswith("w is 1.4 m thick, thinner than two cells (1 m): with single covers")
    assert "water pass through" in found[0]


def long_tank(solid, **tank):
    """A tank of 40 x 8 x 8 m, measured, with cells of 1 m unless `tank` says otherwise."""
    content = case(
        tank={"lower": [0, 0, 0], "upper": [40, 8, 8], "cell": 1, **tank},
        water={"fill": [{"lower": [0, 0, 0], "upper": [10, 8, 4]}]},
        solid=[solid],
    )
    found, wrong = measured(content)
    assert wrong == []
    return found


@pytest.mark.parametrize(
    ("solid", "tank", "says"),
    [
        (QUAY, {}, "quay is 1.2 m thick, thinner than two cells (1 m)"),
        (QUAY, FINE_BOX, "quay is 1.2 m thick, thinner than two cells (1 m)"),
        (
            QUAY | {"size": [2.5, 8, 6]},
            {"stretch": [{"along": "x", "lower": 20, "cell": 4}]},
            "quay is 2.5 m thick, thinner than a cell (4 m)",
        ),
        (QUAY, {"stretch": [{"along": "y", "cell": 2}]}, "quay is 1.2 m thick, thinner than two cells (1 m)"),
        (QUAY, {"refine": [{"around": ["quay"], "levels": 1}]}, ""),
        (
            {"name": "mole", "centre": [20, 4, 1], "size": [36, 1.2, 2]},
            FINE_BOX,
            "mole is 1.2 m thick, thinner than two cells (1 m)",
        ),
    ],
)
def test_walls_are_thin_by_the_cells_that_they_stand_in(solid, tank, says):
    """Finer cells elsewhere make no wall thicker; coarser ones across it make it thinner, along it they do not."""
    found = [text for text in thin_remarks(long_tank(solid, **tank))]
    assert [text[: len(says)] for text in found] == ([says] if says else [])


def test_bodies_that_fill_a_slice_are_not_thin_across_it():
    """Water is on both sides of a wall along a slice, not across it, where the wall reaches from side to side."""
    slice_of = {"tank": {"lower": [0, 0, 0], "upper": [40, 1, 8], "cell": 1}}
    wall = {"name": "w", "size": [3, 1, 6]}
    bodies = [
        {"solid": [wall | {"centre": [20, 0.5, 3]}]},
        structure(wall | {"centre": [20, 0.5, 3]}),
        structure(wall=[{"name": "w", "lower": [20, 0, 0], "size": [3, 1, 6], "block": [3, 1, 1]}]),
    ]
    assert [list(thin_remarks(case(**slice_of, **body))) for body in bodies] == [[], [], []]
    (found,) = thin_remarks(case(**slice_of, solid=[wall | {"centre": [20, 0.5, 3], "size": [0.8, 1, 6]}]))
    assert found.startswith("w is 0.8 m thick, thinner than a cell (1 m)")
    (found,) = thin_remarks(case(**slice_of, solid=[wall | {"centre": [20, 0.4, 3], "size": [3, 0.6, 6]}]))
    assert found.startswith("w is 0.6 m thick")


def test_blocks_walls_and_buildings_are_thin_by_the_cells_that_they_stand_in():
    parts = {
        "block": [{"name": "slab", "centre": [30, 4, 0.25], "size": [2, 2, 0.5]}],
        "wall": [{"name": "w", "lower": [20, 0, 0], "size": [1.5, 4, 2], "block": [1.5, 2, 1]}],
        "building": [
            {"name": "h", "lower": [10, 0, 0], "size": [6, 6, 4], "wall_thickness": 1.2, "block": [1, 1]}
        ],
    }
    for kind, tables in parts.items():
        made = case(
            tank={"lower": [0, 0, 0], "upper": [40, 8, 8], "cell": 1, **FINE_BOX},
            structure={kind: tables},
            contact={"stiffness": 1e6},
        )
        (found,) = thin_remarks(measured(made)[0])
        assert found.startswith(f"{tables[0]['name']} is "), found


def test_a_single_pass_with_blocks_lighter_than_the_water_is_remarked():
    """Of the free blocks the lightest is named; stone needs no second pass, nor a block that is held or driven."""
    stone, wood = {"centre": [7, 5, 0.5]}, {"centre": [7, 7, 0.5], "density": 500.0}
    single = {"coupling": {"passes": 1}}
    (found,) = remarks(
        case(**single, **structure(stone, wood, wood | {"centre": [7, 2, 0.5], "density": 400.0}))
    )
    assert found.startswith("coupling.passes = 1 with 'b2' of 400 kg/m3, lighter than the water (1000 kg/m3)")
    assert "leave coupling.passes at 2" in found
    driven = {"motion": [{"block": "b1", "velocity": [0, 0, 0.1]}]}
    for silent in (
        structure(stone, wood),
        single | structure(stone),
        single | structure(stone, wood | {"fixed": True}),
        single | driven | structure(stone, wood),
        single | {"water": None} | structure(stone, wood),
    ):
        assert not [text for text in remarks(case(**silent)) if "passes" in text]


def test_too_few_points_for_joints_that_close_stiffly_are_remarked():
    """Three Gauss points miss the edge that such a joint turns about."""
    block = structure({"centre": [7, 5, 0.5]})
    joints = {"strength": 1e5, "opening_at_failure": 1e-3, "closing_ratio": 10.0}
    assert remarks(case(joints=joints | {"points": 3}, **block))[0].startswith(
        "joints.points = 3 with joints.closing_ratio = 10"
    )
    for enough in (6, "auto"):
        assert remarks(case(joints=joints | {"points": enough}, **block)) == []


@pytest.mark.parametrize(
    ("sections", "says"),
    [
        (structure({"centre": [7, 5, 0.5]}, density=2.4), "density of 'b0' is 2.4 kg/m3"),
        (
            {
                **structure({"centre": [7, 5, 0.5]}),
                "joints": {"strength": "2 mPa", "opening_at_failure": 1e-3},
            },
            "joints.strength is 0.002 Pa",
        ),
        (
            {**structure({"centre": [7, 5, 0.5]}), "joints": {"strength": 1e6, "opening_at_failure": 1}},
            "joints.opening_at_failure is 1 m",
        ),
        (
            structure({"centre": [7, 5, 2], "rotation": {"axis": [0, 0, 1], "angle": 90}}),
            "structure.block[0].rotation.angle is 90 rad, more than a full turn; degrees are text",
        ),
        (
            {
                "solid": [
                    {
                        "name": "s",
                        "centre": [7, 5, 3],
                        "size": [1, 1, 1],
                        "rotation": {"axis": [1, 0, 0], "angle": -45},
                    }
                ]
            },
            "solid[0].rotation.angle is -45 rad",
        ),
        (
            {**structure({"centre": [7, 5, 0.5]}), "contact": {"stiffness": 1e6, "friction": 40}},
            "contact.friction is 40, rougher than any dry faces; it is the tangential over the normal force, which for "
            "an angle of 40 degrees is 0.84",
        ),
        (
            {
                **structure({"centre": [7, 5, 0.5]}),
                "contact": {"stiffness": 1e6, "pair": [{"materials": ["block", "tank"], "friction": 35}]},
            },
            "contact.pair[0].friction is 35",
        ),
        (
            {"water": {"density": 1, "fill": [{"lower": [0, 0, 0], "upper": [5, 10, 5]}]}},
            'water.density is 1 kg/m3; other units are text, "1 t/m3"',
        ),
        (
            {"gauge": [{"kind": "pressure", "name": "g", "at": [1, 1, 1], "impulse": [2, 3]}]},
            "gauge 'g' begins to add up at 2 s",
        ),
        (
            {"gauge": [{"kind": "flux", "name": "g", "at": [7, 0, 0], "edges": [[0, 10, 0], [0, 0, 5]]}]},
            "75 % of the patch of gauge 'g' lies outside the tank, where nothing flows; its key at is the centre",
        ),
        (
            {**structure({"centre": [7, 5, 2]}), "gauge": [{"kind": "reaction", "name": "g", "on": "b0"}]},
            "gauge 'g' measures what holds 'b0', and nothing does, so that it reads 0",
        ),
    ],
)
def test_values_that_look_like_a_wrong_unit_are_reported(sections, says):
    """Allowed, since somebody may mean it: g/cm3 as a plain number, mPa for MPa, m for mm, a window after the end."""
    assert any(says in remark for remark in remarks(case(**sections)))
    assert reported(case(**sections)) == []


def test_a_unit_weight_that_is_given_as_a_density_is_remarked_on():
    """24 kN/m3 of concrete as 24 kg/m3: the house swims away. A loose float of foam is meant."""
    wall = {"lower": [7, 4, 0], "size": [1, 2, 2], "block": [1, 1, 1], "density": 24}
    sections = {"structure": {"wall": [wall]}, "contact": {"stiffness": 1e9}}
    found = [text for text in remarks(case(**sections)) if "unit weight" in text]
    assert found == [
        "the density of 'wall-0-0-0' is 24 kg/m3, that of foam; a unit weight of 24 kN/m3 is a density of 2446 kg/m3"
    ]
    buoy = structure({"centre": [7, 5, 2], "density": 24}) | {"contact": {"stiffness": 1e9}}
    assert not [text for text in remarks(case(**buoy)) if "unit weight" in text]


def test_plausible_angles_friction_and_densities_are_not_remarked_on():
    """A full turn, rubber on concrete, sea water."""
    block = {"centre": [7, 5, 2], "rotation": {"axis": [0, 0, 1], "angle": "360 deg"}}
    water = {"density": 1025, "fill": [{"lower": [0, 0, 0], "upper": [5, 10, 5]}]}
    found = case(water=water, **structure(block) | {"contact": {"stiffness": 1e9, "friction": 1.2}})
    assert remarks(found) == []
