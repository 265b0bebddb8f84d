"""Points of joints that are taken four at a time have the bits of single points: whether a joint has nine points or
four, and whether all of four hold or one of them tears, must not show in the forces."""

import numpy as np
import pytest
from numba import njit
from scipy.spatial.transform import Rotation

from kernels.lanes import together
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.faces import touching_faces
from yade_scripts.joints import laws
from yade_scripts.joints.arrays import LAST, MU, NOT_GROWING, PULL, Placement, Taken
from yade_scripts.joints.cohesion import JointParameters
from yade_scripts.joints.forces import functions_of, joint_forces
from yade_scripts.joints.joints import Joints
from yade_scripts.joints.specialise import specialised

DF, DT = 1e-3, 1e-4


@njit
def never(p, end, four, j, joints, memory, motion, n, eta, dt):
    """As `four_points`, which leaves all points to the loop over single ones."""
    nothing = together(0.0, 0.0, 0.0, 0.0)
    zero = (nothing, nothing, nothing)
    return False, 0.0, zero, zero, zero, nothing


def taking(law, mixed_mode, instead=None):
    """The loop over joints of a law, instead: in place of `four_points`."""
    name, names = functions_of(law, laws.find(law), mixed_mode)
    if instead is not None:
        names |= {"four_points": instead}
    return specialised(joint_forces, f"{name}_{instead is None}", names, cache=False)


def column(points, law, mixed_mode):
    """Five cubes on one another, which have moved by up to the opening at failure, and the history of their joints:
    some points undamaged, some damaged, some failed."""
    random = np.random.default_rng(points)
    blocks = [Block(f"b{k}", (0.0, 0.0, k), size=1.0) for k in range(5)]
    parameters = JointParameters(1e6, DF, points=points, law=law, mixed_mode=mixed_mode, shear_ratio=1.3)
    joints = Joints(blocks, touching_faces(blocks), parameters)
    joints.law[:, MU] = 0.4
    x = np.array([b.centre for b in blocks]) + DF * random.uniform(-0.4, 0.4, (5, 3))
    R = Rotation.from_rotvec(DF * random.uniform(-0.4, 0.4, (5, 3))).as_matrix()
    v = random.uniform(-1.0, 1.0, (5, 6)) * np.array([[0.02], [0.02], [0.02], [0.3], [0.3]])
    joints.largest[:] = DF * random.choice([0.0, 0.3, 0.7, 1.2], len(joints.largest), p=[0.4, 0.3, 0.2, 0.1])
    joints.paid[:, LAST] = DF * random.uniform(-0.4, 0.4, len(joints.largest))
    return joints, Placement(x, v, R)


def substeps(joints, motion, loop, eta, count=8):
    """Forces of a few substeps of a straight way, and all that they leave."""
    taken, given, fastest, found = Taken(joints.damped, joints.rubbed), np.empty((len(joints), 6)), [], []
    for k in range(count):
        now = Placement(motion.x + k * DT * motion.v[:, :3], motion.v, motion.R)
        state = (joints.live, joints._points[0], joints._memory(), now, eta, DT, True, given, taken)
        fastest.append(loop(0, len(joints.live), *state))
        found.append(given.copy())
    return [np.array(fastest), *found, joints.largest, joints.paid, joints.rub, joints.damped, joints.rubbed]


@pytest.mark.parametrize(("law", "mixed_mode"), [("bilinear", "effective"), ("polynomial", "needleman")])
def test_four_points_at_a_time_have_the_bits_of_single_ones(law, mixed_mode):
    own, single = taking(law, mixed_mode), taking(law, mixed_mode, never)
    tears = []
    for points, eta in ((1, 1e-4), (2, 0.0), (3, 1e-4)):
        fours, ones = column(points, law, mixed_mode), column(points, law, mixed_mode)
        found, expected = substeps(*fours, own, eta), substeps(*ones, single, eta)
        assert [a.tobytes() for a in found] == [a.tobytes() for a in expected]
        tears.extend(fours[0].paid[:, PULL] != NOT_GROWING)
    assert any(tears)
    assert not all(tears)
