"""The command `surgebreak kernels`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from coupler.program.failures import Failures
from coupler.program.start import one_thread


def kernels(
    pack: Annotated[
        Path | None,
        typer.Option("--pack", metavar="FILE", help="write the kernels of this version into one file"),
    ] = None,
    unpack: Annotated[
        Path | None,
        typer.Option(
            "--unpack",
            metavar="FILE",
            help="add the kernels of a file to the cache; only from sources that you trust",
        ),
    ] = None,
) -> None:
    """Show, pack or unpack compiled kernels for other machines.

    A machine that unpacks them need not compile them. Without an option it shows where they are, and how many modules
    of this version have compiled kernels.
    """
    one_thread()
    from coupler.program import kernel_pack

    with Failures():
        if pack:
            print(f"{kernel_pack.pack(pack)} modules packed into {pack} ({pack.stat().st_size / 1e6:.0f} MB)")
        if unpack:
            print(f"{kernel_pack.unpack(unpack)} files are new in {os.environ['NUMBA_CACHE_DIR']}")
        if not pack and not unpack:
            print(
                f"{len(kernel_pack.compiled())} modules with kernels of this version in {os.environ['NUMBA_CACHE_DIR']}"
            )
