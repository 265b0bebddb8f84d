"""CohFrict: a linear bond that breaks at once, in tension or in shear.

    F_n = k_n u_n up to a_n,  F_s = k_s u_s up to a_s (+ F_n tan φ unless cohesion disables friction), then nothing

YADE: Law2_ScGeom6D_CohFrictPhys_CohesionMoment on CohFrictPhys. Work of separation a_n²/(2 k_n): with the stiffness and
strength of the joint, 2/27 T_max δ_f against 9/16 T_max δ_f of the polynomial law.
Bourrier, Kneib, Chareyre and Fourcaud, Ecological Engineering 61 (2013) 646; YADE documentation.
"""

import math

TITLE = "CohFrict"
LAW2 = "Law2_ScGeom6D_CohFrictPhys_CohesionMoment"
VARIANTS = {
    "stiffness": ("G_c: T_max²/(2 K_0), 2/27 instead of 9/16 T_max δ_f",),
    "energy": ("stiffness: softer by 2 G_c K_0/T_max², 7.6 times",),
}
"""The property (stiffness, strength or G_c) that each variant does not match; the first variant is the default."""
NOT_MATCHED = ("no softening", "tension and shear fail independently")


def bond(area, joint, variant="stiffness"):
    """Numbers of one bond. area [m²]; joint: stiffness [Pa/m], strength [Pa], work [J/m²], shear_ratio, friction

    k_n = K_0 A, a_n = T_max A, k_s = β² k_n, a_s = β a_n; variant "energy": k_n = T_max² A/(2 G_c).
    """
    k, beta = joint["stiffness"], joint["shear_ratio"]
    if variant == "energy":
        k = joint["strength"] ** 2 / (2.0 * joint["work"])
    a = joint["strength"] * area
    return {"kn": k * area, "ks": beta**2 * k * area, "tension": a, "shear": beta * a}


def material(joint):
    """Material of the spheres; the numbers of each bond are set separately."""
    from yade.wrapper import CohFrictMat

    angle = math.atan(joint["friction"])
    young = joint["stiffness"] * joint["edge"]
    return CohFrictMat(young=young, poisson=1.0, frictionAngle=angle, normalCohesion=1.0, shearCohesion=1.0)


def functors(joint):
    """Geometry, physics and law functor."""
    from yade.wrapper import (
        Ig2_Sphere_Sphere_ScGeom6D,
        Ip2_CohFrictMat_CohFrictMat_CohFrictPhys,
        Law2_ScGeom6D_CohFrictPhys_CohesionMoment,
    )

    physics = Ip2_CohFrictMat_CohFrictMat_CohFrictPhys(setCohesionNow=True, setCohesionOnNewContacts=False)
    return Ig2_Sphere_Sphere_ScGeom6D(), physics, Law2_ScGeom6D_CohFrictPhys_CohesionMoment()


def set_bond(phys, numbers):
    """Write the numbers into a bond of YADE."""
    phys.kn, phys.ks = numbers["kn"], numbers["ks"]
    phys.normalAdhesion, phys.shearAdhesion = numbers["tension"], numbers["shear"]
    phys.cohesionDisablesFriction = True


def failed(phys):
    """Whether a bond still listed holds no tension."""
    return phys.cohesionBroken
