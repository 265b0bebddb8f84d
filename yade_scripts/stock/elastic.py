"""The elastic energy of a bond with two linear springs. A law with other springs has a function of the same name, which
stands after this one in its script."""


def stored(phys):
    """Elastic energy [J]."""
    n, s = phys.normalForce, phys.shearForce
    return 0.5 * (n.dot(n) / phys.kn + s.dot(s) / phys.ks)
