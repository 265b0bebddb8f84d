"""Stiffness and damping of springs between bodies against the sum of Bᵀ D B, written out."""

import numpy as np

from yade_scripts.blocks.tangent import Springs, assemble

BODIES = 5


def random_springs(count, seed=0):
    """Springs between random pairs of bodies, in both orders, some of them to the fixed world, some without force."""
    random = np.random.default_rng(seed)
    a = random.integers(0, BODIES, count)
    b = (a + random.integers(1, BODIES, count)) % BODIES
    b[::7] = -1
    normal = random.normal(size=(count, 3))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    kn, cn = random.uniform(0.5, 2.0, (2, count))
    kn[::5] = 0.0
    arms = random.normal(size=(2, count, 3))
    return Springs(
        a=a, b=b, arm_a=arms[0], arm_b=arms[1], normal=normal, kn=kn, kt=0.3 * kn, cn=cn, ct=0.1 * cn
    )


def across(r):
    """v + ω × r as a matrix (3, 6)."""
    x, y, z = r
    return np.hstack([np.eye(3), [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]])


def summed(springs, kn, kt):
    """Σ Bᵀ (k_n nnᵀ + k_t (I - nnᵀ)) B, spring by spring."""
    total = np.zeros((6 * BODIES, 6 * BODIES))
    for s in range(len(springs.a)):
        n = springs.normal[s]
        D = (kn[s] - kt[s]) * np.outer(n, n) + kt[s] * np.eye(3)
        B = np.zeros((3, 6 * BODIES))
        for body, sign, arm in (
            (springs.a[s], 1.0, springs.arm_a[s]),
            (springs.b[s], -1.0, springs.arm_b[s]),
        ):
            if body >= 0:
                B[:, 6 * body : 6 * body + 6] += sign * across(arm)
        total += B.T @ D @ B
    return total


def test_springs_add_up_to_the_quadratic_form_of_their_stretching():
    """Several springs of one pair, and several pairs of one body, share entries of the matrix."""
    springs = random_springs(60)
    K, C = assemble(springs, BODIES)
    np.testing.assert_allclose(K.toarray(), summed(springs, springs.kn, springs.kt), atol=1e-13)
    np.testing.assert_allclose(C.toarray(), summed(springs, springs.cn, springs.ct), atol=1e-13)


def test_each_entry_of_the_matrix_is_listed_once():
    """What reads the rows, the factorisation among it, relies on sorted columns without repetition."""
    K, _ = assemble(random_springs(60), BODIES)
    for row in range(6 * BODIES):
        columns = K.indices[K.indptr[row] : K.indptr[row + 1]]
        assert (np.diff(columns) > 0).all()


def test_without_springs_there_is_no_stiffness():
    """Bodies in free flight."""
    K, C = assemble(Springs.none(), BODIES)
    assert K.shape == C.shape == (6 * BODIES, 6 * BODIES)
    assert K.nnz == C.nnz == 0
