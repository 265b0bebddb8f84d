"""JCFpm, jointed cohesive frictional particle model: a linear bond that breaks at once, Mohr-Coulomb in shear.

    F_n = k_n u_n up to F_n,max;  F_s = k_s u_s up to F_s,max + F_n tan φ (F_n > 0 in compression), then nothing

YADE: Law2_ScGeom_JCFpmPhys_JointedCohesiveFrictionalPM. Scholtès and Donzé, Int. J. Rock Mech. Min. Sci. 52 (2012) 18;
J. Mech. Phys. Solids 61 (2013) 352. Work of separation F_n,max²/(2 k_n), as CohFrict.
"""

import math

TITLE = "JCFpm"
LAW2 = "Law2_ScGeom_JCFpmPhys_JointedCohesiveFrictionalPM"
VARIANTS = {
    "stiffness": ("G_c: T_max²/(2 K_0), 2/27 instead of 9/16 T_max δ_f",),
    "energy": ("stiffness: softer by 2 G_c K_0/T_max², 7.6 times",),
}
"""The property (stiffness, strength or G_c) that each variant does not match; the first variant is the default."""
NOT_MATCHED = ("no softening", "shear strength grows with compression (Coulomb) and falls with tension")


def bond(area, joint, variant="stiffness"):
    """Numbers of one bond. area [m²]; joint: stiffness [Pa/m], strength [Pa], work [J/m²], shear_ratio, friction

    k_n = K_0 A, F_n,max = T_max A, k_s = β² k_n, F_s,max = β F_n,max; variant "energy": k_n = T_max² A/(2 G_c).
    """
    k, beta = joint["stiffness"], joint["shear_ratio"]
    if variant == "energy":
        k = joint["strength"] ** 2 / (2.0 * joint["work"])
    most = joint["strength"] * area
    return {"kn": k * area, "ks": beta**2 * k * area, "tension": most, "shear": beta * most, "area": area}


def material(joint):
    """Material of the spheres; the numbers of each bond are set separately."""
    from yade.wrapper import JCFpmMat

    angle = math.atan(joint["friction"])
    young = joint["stiffness"] * joint["edge"]
    return JCFpmMat(young=young, poisson=1.0, frictionAngle=angle, tensileStrength=1.0, cohesion=1.0, type=1)


def functors(joint):
    """Geometry, physics and law functor; bonds are those made in the first step."""
    from yade.wrapper import (
        Ig2_Sphere_Sphere_ScGeom,
        Ip2_JCFpmMat_JCFpmMat_JCFpmPhys,
        Law2_ScGeom_JCFpmPhys_JointedCohesiveFrictionalPM,
    )

    physics = Ip2_JCFpmMat_JCFpmMat_JCFpmPhys(cohesiveTresholdIteration=1)
    return Ig2_Sphere_Sphere_ScGeom(), physics, Law2_ScGeom_JCFpmPhys_JointedCohesiveFrictionalPM()


def set_bond(phys, numbers):
    """Write the numbers into a bond of YADE."""
    phys.kn, phys.ks = numbers["kn"], numbers["ks"]
    phys.FnMax, phys.FsMax, phys.crossSection = numbers["tension"], numbers["shear"], numbers["area"]


def failed(phys):
    """Whether a bond still listed holds no tension."""
    return not phys.isCohesive
