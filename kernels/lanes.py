"""Four numbers at a time: a type of numba for the vector registers of the processor.

    t = taken(table, at)          four numbers of a contiguous array from the entry `at` on
    u = larger(t, 0.0) * s        with numbers, which stand for four alike, or with other fours
    a, b, c, d = parts(u)

Each of the four has the bits of the same arithmetic with single numbers: products and sums are not fused, and there are
no sums over the four. LLVM makes no such code of loops over the points of a joint by itself: with as many arrays it
gives up on finding out whether they overlap.

What is named below besides takes single numbers, too, so that a formula can be written once for both.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, lower_cast, models, register_model

from kernels.decorators import inner, plain

LANES = 4
VECTOR = ir.VectorType(ir.DoubleType(), LANES)


class Four(types.Type):
    """Numba's type of four numbers."""

    def __init__(self) -> None:
        super().__init__(name="Four")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """A number stands for four alike."""
        return Conversion.safe if isinstance(other, types.Float) else None


four = Four()


@register_model(Four)
class _Model(models.PrimitiveModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, VECTOR)


def _spread(builder, value):
    """A vector of a number; a vector as it is."""
    if value.type == VECTOR:
        return value
    first = builder.insert_element(ir.Constant(VECTOR, ir.Undefined), value, ir.Constant(ir.IntType(32), 0))
    mask = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(first, ir.Constant(VECTOR, ir.Undefined), mask)


@lower_cast(types.Float, Four)
def _of_number(context, builder, kind, to, value):
    return _spread(builder, context.cast(builder, value, kind, types.float64))


def for_both(function: Callable) -> Any:
    """Compile a function of single numbers, or of fours, as `plain`. A module that uses it imports this one, so that
    the kernels of it that are kept change with what four numbers are."""
    return plain(function)


class _Arithmetic(AbstractTemplate):
    """Four numbers with four numbers or with one; of two single numbers, numba knows itself what they give."""

    def generic(self, args, kws):
        """The types of a call."""
        if (
            kws
            or four not in args
            or not all(kind == four or isinstance(kind, types.Number) for kind in args)
        ):
            return None
        return signature(four, *(kind if kind == four else types.float64 for kind in args))


def _operator(function: Any, name: str, *of_operands: tuple) -> None:
    infer_global(function)(type("_Template", (_Arithmetic,), {}))

    def code(context, builder, given, args):
        return getattr(builder, name)(*(_spread(builder, value) for value in args))

    for operands in of_operands:
        lower_builtin(function, *operands)(code)


for _function, _name in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _operator(_function, _name, (four, four), (four, types.float64), (types.float64, four))
_operator(operator.neg, "fneg", (four,))


def _numbers(context, builder, given, args, kind) -> list:
    """Values as numbers, or all as vectors if `kind` is that of vectors."""
    plain = [
        value if of == four else context.cast(builder, value, of, types.float64)
        for of, value in zip(given.args, args)
    ]
    return [_spread(builder, value) for value in plain] if kind == four else plain


def _kind(*given: Any) -> Any:
    return four if four in given else types.float64


@intrinsic
def larger(typingctx, a, b):
    """max(a, b)."""
    kind = _kind(a, b)

    def code(context, builder, given, args):
        a, b = _numbers(context, builder, given, args, kind)
        return builder.select(builder.fcmp_ordered(">", b, a), b, a)

    return kind(a, b), code


@intrinsic
def where_more(typingctx, a, b, x, y):
    """x where a > b, else y."""
    kind = _kind(a, b, x, y)

    def code(context, builder, given, args):
        a, b, x, y = _numbers(context, builder, given, args, kind)
        return builder.select(builder.fcmp_ordered(">", a, b), x, y)

    return kind(a, b, x, y), code


def _any(compared: Any) -> Any:
    """Code for whether compared(builder, a, b) holds for one of the four."""

    def code(context, builder, given, args):
        a, b = _numbers(context, builder, given, args, four)
        found = builder.bitcast(compared(builder, a, b), ir.IntType(LANES))
        return builder.icmp_unsigned("!=", found, ir.Constant(ir.IntType(LANES), 0))

    return code


@intrinsic
def any_more(typingctx, a, b):
    """Whether a > b for one of the four."""
    return types.boolean(a, b), _any(lambda builder, a, b: builder.fcmp_ordered(">", a, b))


@intrinsic
def any_not_less(typingctx, a, b):
    """Whether a < b fails for one of the four, as it also does for numbers that are not finite."""
    return types.boolean(a, b), _any(lambda builder, a, b: builder.fcmp_unordered(">=", a, b))


def _of_llvm(name: str, context, builder, given, args, kind):
    (value,) = _numbers(context, builder, given, args, kind)
    full = f"{name}.{'v4f64' if kind == four else 'f64'}"
    function = cgutils.get_or_insert_function(builder.module, ir.FunctionType(value.type, [value.type]), full)
    return builder.call(function, [value])


@intrinsic
def root(typingctx, a):
    """Square root."""
    kind = _kind(a)
    return kind(a), lambda *call: _of_llvm("llvm.sqrt", *call, kind)


@intrinsic
def magnitude(typingctx, a):
    """Absolute value."""
    kind = _kind(a)
    return kind(a), lambda *call: _of_llvm("llvm.fabs", *call, kind)


@intrinsic
def parts(typingctx, a):
    """The four numbers as a tuple."""

    def code(context, builder, given, args):
        own = [builder.extract_element(args[0], ir.Constant(ir.IntType(32), k)) for k in range(LANES)]
        return context.make_tuple(builder, given.return_type, own)

    return types.UniTuple(types.float64, LANES)(four), code


@intrinsic
def together(typingctx, a, b, c, d):
    """Four of single numbers."""

    def code(context, builder, given, args):
        found = ir.Constant(VECTOR, ir.Undefined)
        for k, value in enumerate(_numbers(context, builder, given, args, types.float64)):
            found = builder.insert_element(found, value, ir.Constant(ir.IntType(32), k))
        return found

    return four(a, b, c, d), code


@inner
def added(total, a, count):
    """A number and the first `count` of four, 1 to 4, added to it one after the other."""
    b, c, d, e = parts(a)
    total += b
    if count > 1:
        total += c
    if count > 2:
        total += d
    if count > 3:
        total += e
    return total


@intrinsic
def taken(typingctx, array, at):
    """Four numbers of a contiguous array of doubles from its entry `at` on, of whatever shape it is."""
    if not (isinstance(array, types.Array) and array.dtype == types.float64 and array.layout == "C"):
        raise TypeError(f"{array}: must be a contiguous array of doubles")

    def code(context, builder, given, args):
        data = context.make_array(given.args[0])(context, builder, args[0]).data
        place = context.cast(builder, args[1], given.args[1], types.int64)
        pointer = builder.bitcast(builder.gep(data, [place]), VECTOR.as_pointer())
        return builder.load(pointer, align=8)

    return four(array, at), code
