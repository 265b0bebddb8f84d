"""Cpm, concrete particle model (public version): elastic, then softening in tension by the damage ω of the largest
strain κ.

    σ = (1 - ω) E ε in tension, E ε in compression;  |τ| ≤ c (1 - ω) - σ tan φ, perfectly plastic
    exponential  1 - ω = (ε_0/κ) exp(-(κ - ε_0)/ε_f)         G_c = T_max (u_0/2 + u_f)
    linear       ω = (1 - ε_0/κ)/(1 - ε_0/ε_f), broken at ε_f   G_c = T_max u_f/2         (u = ε L, u_0 = T_max/K_0)

YADE: Law2_ScGeom_CpmPhys_Cpm. Šmilauer, Cohesive particle model using the discrete element method on the Yade
platform, PhD thesis, CTU Prague (2010). Stiffness, strength and G_c of tension are all matched; the softening curve
differs.
"""

import math

TITLE = "Cpm (concrete)"
LAW2 = "Law2_ScGeom_CpmPhys_Cpm"
VARIANTS = {
    "exponential": ("the tail: 1 % of the strength is left at 2.4 δ_f, where the bond is taken out",),
    "linear": ("full loss at 9/8 δ_f",),
}
"""The property (stiffness, strength or G_c) that each variant does not match; the first variant is the default."""
NOT_MATCHED = (
    "shape of the softening curve",
    "shear does not soften: perfectly plastic under c = β T_max",
    "shear strength grows with compression (Coulomb) and falls with tension",
)
LEFT = 0.01
"""Share of the strength at which an exponential bond counts as failed, since it never breaks by itself."""


def bond(area, joint, variant="exponential"):
    """Numbers of one bond of unit length. area [m²]; joint: stiffness K_0 [Pa/m], strength T_max [Pa], work G_c [J/m²],
    shear_ratio β, friction tan φ

    E = K_0, u_0 = T_max/K_0; exponential: u_f = G_c/T_max - u_0/2; linear: u_f = 2 G_c/T_max.
    """
    from math import log

    beta, onset = joint["shear_ratio"], joint["strength"] / joint["stiffness"]
    if variant == "linear":
        end, damage = 2.0 * joint["work"] / joint["strength"], 1.0
    else:
        end = joint["work"] / joint["strength"] - 0.5 * onset
        damage = 1.0 - LEFT * onset / (onset - end * log(LEFT))
    return {
        "E": joint["stiffness"],
        "G": beta**2 * joint["stiffness"],
        "area": area,
        "onset": onset,
        "end": end,
        "law": 0 if variant == "linear" else 1,
        "damage": damage,
        "cohesion": beta * joint["strength"],
        "friction": joint["friction"],
    }


def material(joint):
    """Material of the spheres; the numbers of each bond are set separately."""
    from yade.wrapper import CpmMat

    angle = math.atan(joint["friction"])
    young = joint["stiffness"] * joint["edge"]
    return CpmMat(
        young=young, poisson=1.0, frictionAngle=angle, sigmaT=1.0, epsCrackOnset=1.0, relDuctility=2.0
    )


def functors(joint):
    """Geometry, physics and law functor; bonds are those made in the first step."""
    from yade.wrapper import Ig2_Sphere_Sphere_ScGeom, Ip2_CpmMat_CpmMat_CpmPhys, Law2_ScGeom_CpmPhys_Cpm

    law = Law2_ScGeom_CpmPhys_Cpm(omegaThreshold=bond(1.0, joint, joint["variant"])["damage"])
    return Ig2_Sphere_Sphere_ScGeom(), Ip2_CpmMat_CpmMat_CpmPhys(cohesiveThresholdIter=1), law


def set_bond(phys, numbers):
    """Write the numbers into a bond of YADE; reference length 1 m, so that strain is displacement."""
    phys.E, phys.G, phys.crossSection, phys.refLength = numbers["E"], numbers["G"], numbers["area"], 1.0
    phys.kn, phys.ks = numbers["E"] * numbers["area"], numbers["G"] * numbers["area"]
    phys.epsCrackOnset, phys.epsFracture = numbers["onset"], numbers["end"]
    phys.relDuctility, phys.damLaw = numbers["end"] / numbers["onset"], numbers["law"]
    phys.undamagedCohesion, phys.tanFrictionAngle = numbers["cohesion"], numbers["friction"]


def failed(phys):
    """Whether a bond still listed holds no tension."""
    return not phys.isCohesive


def stored(phys):
    """Elastic energy [J]: with the secant stiffness in tension, the initial one in compression and shear."""
    n, s = phys.normalForce, phys.shearForce
    left = 1.0 - phys.omega if phys.epsN > 0.0 else 1.0
    return 0.5 * (n.dot(n) / (left * phys.kn) + s.dot(s) / phys.ks)
