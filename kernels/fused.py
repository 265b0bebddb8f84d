"""The fused product of numbers, for kernels whose digits are those of BLAS, which rounds products and sums together."""

from __future__ import annotations

from numba import types
from numba.extending import intrinsic


@intrinsic
def fused(typingctx, a, b, c):
    """a b + c, rounded once."""

    def code(context, builder, signature, args):
        return builder.fma(*args)

    return types.float64(types.float64, types.float64, types.float64), code
