"""Mortar: a linear bond that breaks at once where the stress leaves Lourenço's envelope.

    σ = K_n ε, τ = K_s γ while  σ ≤ f_t  and  τ ≤ c - σ tan φ  and  σ² + A² τ² ≤ f_c²  (σ > 0 in tension), then nothing

YADE: Law2_ScGeom_MortarPhys_Lourenco, the envelope of Lourenço, Analysis of masonry structures with interface
elements, TU Delft report 03-21-22-0-01 (1994). A broken bond is removed from the scene together with its contact.
"""

import math

TITLE = "Mortar (Lourenço)"
LAW2 = "Law2_ScGeom_MortarPhys_Lourenco"
VARIANTS = {
    "stiffness": ("G_c: T_max²/(2 K_0), 2/27 instead of 9/16 T_max δ_f",),
    "energy": ("stiffness: softer by 2 G_c K_0/T_max², 7.6 times",),
}
"""The property (stiffness, strength or G_c) that each variant does not match; the first variant is the default."""
NOT_MATCHED = (
    "no softening",
    "shear strength grows with compression (Coulomb) and falls with tension",
    "fails in compression too (here at 1000 T_max)",
    "a broken joint has no contact either: blocks pass through each other",
)
COMPRESSIVE = 1e3
"""f_c over T_max, so large that the cap has no influence."""


def bond(area, joint, variant="stiffness"):
    """Numbers of one bond. area [m²]; joint: stiffness [Pa/m], strength [Pa], work [J/m²], shear_ratio, friction

    optional: compression f_c [Pa], aspect A of the cap

    k_n = K_0 A, f_t = T_max, k_s = β² k_n, c = β T_max; variant "energy": k_n = T_max² A/(2 G_c).
    """
    k, beta = joint["stiffness"], joint["shear_ratio"]
    if variant == "energy":
        k = joint["strength"] ** 2 / (2.0 * joint["work"])
    return {
        "kn": k * area,
        "ks": beta**2 * k * area,
        "area": area,
        "tension": joint["strength"],
        "cohesion": beta * joint["strength"],
        "compression": joint.get("compression", COMPRESSIVE * joint["strength"]),
        "aspect": joint.get("aspect", 1.0),
        "friction": joint["friction"],
    }


def inside(sigma, tau, tension, cohesion, friction, compression, aspect):
    """Whether a stress (σ > 0 in tension) [Pa] lies inside or on Lourenço's envelope."""
    return (
        sigma <= tension
        and tau <= cohesion - sigma * friction
        and sigma**2 + (aspect * tau) ** 2 <= compression**2
    )


def material(joint):
    """Material of the spheres; the numbers of each bond are set separately."""
    from yade.wrapper import MortarMat

    angle = math.atan(joint["friction"])
    return MortarMat(young=joint["stiffness"] * joint["edge"], poisson=1.0, frictionAngle=angle)


def functors(joint):
    """Geometry, physics and law functor; contacts after the first step get no bond."""
    from yade.wrapper import (
        Ig2_Sphere_Sphere_ScGeom,
        Ip2_MortarMat_MortarMat_MortarPhys,
        Law2_ScGeom_MortarPhys_Lourenco,
    )

    physics = Ip2_MortarMat_MortarMat_MortarPhys(cohesiveThresholdIter=1)
    return Ig2_Sphere_Sphere_ScGeom(), physics, Law2_ScGeom_MortarPhys_Lourenco()


def set_bond(phys, numbers):
    """Write the numbers into a bond of YADE."""
    phys.kn, phys.ks, phys.crossSection = numbers["kn"], numbers["ks"], numbers["area"]
    phys.tensileStrength, phys.cohesion = numbers["tension"], numbers["cohesion"]
    phys.compressiveStrength, phys.tangensOfFrictionAngle = numbers["compression"], numbers["friction"]
    phys.ellAspect = numbers["aspect"]


def failed(phys):
    """Whether a bond still listed holds no tension: always false, since broken bonds are removed."""
    return False
