"""The energies of a structure as one number."""


def balance(energies):
    """Energies minus works [J] of `readings.energies`: constant where the ledger closes."""
    works = ("load_work", "driving_work")
    return sum(v for k, v in energies.items() if k not in works) - sum(energies[k] for k in works)
