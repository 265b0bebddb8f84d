"""The files of a figure: for publication, or the least that a page needs."""

import matplotlib.pyplot as plt

FORMATS = ("pdf", "svg", "png")
"""Endings of the files of a figure for publication."""
FOR_A_PAGE = ("svg",)
"""Endings for a page, which shows the smaller of SVG and PNG: that is the SVG, unless it is large."""
LARGE = 100_000
"""Bytes of an SVG from which a PNG can be the smaller file; those of a figure of the histories have 45 000 to 400 000
at 300 dots per inch."""


def save(drawing, stem, endings=FORMATS):
    """Save a figure under `stem` (a path without ending) and close it; for a page a large SVG gets a PNG as well."""
    for ending in endings:
        path = stem.with_name(f"{stem.name}.{ending}")
        drawing.savefig(path, metadata=undated(ending))
        if endings == FOR_A_PAGE and path.stat().st_size > LARGE:
            drawing.savefig(stem.with_name(f"{stem.name}.png"))
    plt.close(drawing)


def undated(ending):
    """Metadata without a date, so that the same run gives the same file."""
    return {"pdf": {"CreationDate": None}, "svg": {"Date": None}}.get(ending)
