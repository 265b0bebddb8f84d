"""Conjugate gradients for the viscous stage, with the diagonal as preconditioner, and without a matrix.

    (M + τ K) (d, D) = (right, body_right)

The products with K that the search takes anyway are summed up to K (d, D), which tells what acts on the nodes and on
the bodies at the end of a stage."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Floats
from fluid.viscous.kernels import (
    body_preconditioner,
    follow_water,
    hand_in,
    preconditioner,
    restrict,
    unheld_rate,
)
from kernels.decorators import ranged
from kernels.threads import CHUNK, over, summed


class Change(NamedTuple):
    """d (N, 3) [m/s] · D (n_bodies, 6) [m/s, rad/s] · number of iterations · the last residual over the first · rate
    (N, 3) [N] and load (n_bodies, 6) [N, N m]: `unheld_rate` of (d, D)."""

    d: Floats
    D: Floats
    iterations: int
    left: float
    rate: Floats
    load: Floats


class Implicit:
    """M + τ K with its preconditioner: terms: ViscousTerms · mass (N,) [kg] · tau [s] · bodies: (mass (n_bodies, 6, 6)
    [kg, kg m²], moves (n_bodies,) bool: the others keep their velocity)."""

    def __init__(self, terms, mass, tau, bodies):
        self.terms, self.mass, self.tau = terms, mass, tau
        self.body_mass, self.moves = bodies
        self.inverse = preconditioner(terms, mass, tau)
        self.body_inverse = body_preconditioner(terms, self.body_mass, self.moves, tau)

    def solve(self, right, body_right, tolerance, most) -> Change:
        """The change for right (N, 3) [N s] and body_right (n_bodies, 6) [N s, N m s], after `most` iterations or where
        the residual is less than the tolerance times the first one."""
        nodes, inverse = self.terms.corners.nodes, self.inverse
        d, rate = np.zeros_like(right), np.zeros_like(right)
        D, load = np.zeros_like(body_right), np.zeros_like(body_right)
        r, R = right.copy(), body_right.copy()
        p, P = np.zeros_like(right), np.zeros_like(R)
        Z = _answers(self.body_inverse, R)
        rz = first = _scaled_square(nodes, inverse, r) + float((R * Z).sum())
        count, share = 0, 0.0
        while rz > tolerance * tolerance * first and count < most:
            over(_turn, len(nodes), nodes, inverse, r, share, p)
            P = Z + share * P
            follow_water(self.terms, p)
            gained, loads = unheld_rate(self.terms, p, P)
            Ap, AP = self._product(p, P, gained, loads)
            alpha = rz / (product_of(nodes, p, Ap) + float((P * AP).sum()))
            over(_go, len(nodes), nodes, alpha, p, Ap, gained, d, r, rate)
            D += alpha * P
            R -= alpha * AP
            load += alpha * loads
            Z = _answers(self.body_inverse, R)
            before, rz = rz, _scaled_square(nodes, inverse, r) + float((R * Z).sum())
            share = rz / before
            count += 1
        return Change(d, D, count, np.sqrt(rz / first) if first > 0.0 else 0.0, rate, load)

    def _product(self, p, P, gained, loads):
        """M (p, P) less τ times what `unheld_rate` gives for it, as far as sides let it go."""
        nodes, Ap = self.terms.corners.nodes, np.zeros_like(p)
        over(_left, len(nodes), nodes, self.mass, self.tau, self.terms.node_drag, p, gained, Ap)
        restrict(self.terms, Ap)
        hand_in(self.terms, Ap)
        AP = np.where(self.moves[:, None], _answers(self.body_mass, P) - self.tau * loads, 0.0)
        return Ap, AP


def _answers(matrix, R):
    """The products of matrices (n, 6, 6) and R (n, 6) for each body."""
    return np.einsum("bij,bj->bi", matrix, R)


@ranged
def _turn(first, last, nodes, inverse, r, share, p):
    """p ← inverse r + share p."""
    for s in range(first, last):
        i = np.uint64(nodes[s])
        for k in range(3):
            p[i, k] = inverse[i] * r[i, k] + share * p[i, k]


@ranged
def _left(first, last, nodes, mass, tau, node_drag, p, gained, out):
    """mass p - tau (gained - node_drag p)."""
    for s in range(first, last):
        i = np.uint64(nodes[s])
        for k in range(3):
            out[i, k] = mass[i] * p[i, k] - tau * (gained[i, k] - node_drag[i] * p[i, k])


@ranged
def _go(first, last, nodes, alpha, p, Ap, gained, d, r, rate):
    """The three sums of conjugate gradients along p."""
    for s in range(first, last):
        i = np.uint64(nodes[s])
        for k in range(3):
            d[i, k] += alpha * p[i, k]
            r[i, k] -= alpha * Ap[i, k]
            rate[i, k] += alpha * gained[i, k]


def product_of(nodes, a, b) -> float:
    """Σ a_i · b_i of a and b (N, 3) over the listed nodes (n,)."""
    return float(summed(_products, len(nodes), (1,), nodes, a, b)[0])


@ranged
def _products(first, last, nodes, a, b, partial):
    for c in range(first, last):
        total = 0.0
        for s in range(c * CHUNK, min((c + 1) * CHUNK, nodes.shape[0])):
            i = np.uint64(nodes[s])
            total += a[i, 0] * b[i, 0] + a[i, 1] * b[i, 1] + a[i, 2] * b[i, 2]
        partial[c, 0] = total


def _scaled_square(nodes, factor, r) -> float:
    """Σ factor_i |r_i|² of r (N, 3) over the listed nodes (n,)."""
    return float(summed(_scaled_squares, len(nodes), (1,), nodes, factor, r)[0])


@ranged
def _scaled_squares(first, last, nodes, factor, r, partial):
    for c in range(first, last):
        total = 0.0
        for s in range(c * CHUNK, min((c + 1) * CHUNK, nodes.shape[0])):
            i = np.uint64(nodes[s])
            total += factor[i] * (r[i, 0] * r[i, 0] + r[i, 1] * r[i, 1] + r[i, 2] * r[i, 2])
        partial[c, 0] = total
