"""FrictPhys: contact without cohesion, the cheapest law, from which the extra cost of a bonded law is measured.

    F_n = k_n u_n in compression, |F_s| ≤ F_n tan φ, nothing in tension

YADE: Law2_ScGeom_FrictPhys_CundallStrack. Cundall and Strack, Géotechnique 29 (1979) 47.
"""

import math

TITLE = "FrictPhys (no cohesion)"
LAW2 = "Law2_ScGeom_FrictPhys_CundallStrack"
VARIANTS = {"plain": ("strength and G_c: none",)}
"""The property (stiffness, strength or G_c) that each variant does not match; the first variant is the default."""
NOT_MATCHED = ("holds no tension at all: for its cost only",)


def bond(area, joint, variant="plain"):
    """Numbers of one contact. area [m²]; joint: stiffness [Pa/m], shear_ratio, friction. k_n = K_0 A, k_s = β² k_n."""
    k = joint["stiffness"] * area
    return {"kn": k, "ks": joint["shear_ratio"] ** 2 * k, "friction": joint["friction"]}


def material(joint):
    """Material of the spheres."""
    from yade.wrapper import FrictMat

    angle = math.atan(joint["friction"])
    return FrictMat(young=joint["stiffness"] * joint["edge"], poisson=1.0, frictionAngle=angle)


def functors(joint):
    """Geometry, physics and law functor; open contacts stay listed, so that each costs as much as a bond."""
    from yade.wrapper import (
        Ig2_Sphere_Sphere_ScGeom,
        Ip2_FrictMat_FrictMat_FrictPhys,
        Law2_ScGeom_FrictPhys_CundallStrack,
    )

    law = Law2_ScGeom_FrictPhys_CundallStrack(neverErase=True)
    return Ig2_Sphere_Sphere_ScGeom(), Ip2_FrictMat_FrictMat_FrictPhys(), law


def set_bond(phys, numbers):
    """Write the numbers into a contact of YADE."""
    phys.kn, phys.ks, phys.tangensOfFrictionAngle = numbers["kn"], numbers["ks"], numbers["friction"]


def failed(phys):
    """Whether a contact counts as failed: never, since it has no cohesion to lose."""
    return False
