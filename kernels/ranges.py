"""The entry from Python into a kernel whose range several threads share.

Numba's entry unpacks the arguments, releases the interpreter and calls the kernel. The one made here can do more: where
`first` is negative, it is minus the address of a plan (`Plan`), and `last` is the number of rows. The entry then hands
the kernel, with the unpacked arguments that all threads share, to the function at Plan.run, which calls it once for
each part of the range. So no other thread ever needs the interpreter, and a loop costs no more calls from Python than
on one thread. The entry returns a list: what the kernel returned for each part, in order. If parts fail, the error of
the first of them is raised.

An argument `runs` (k, 2) that follows the range holds the runs of all parts, one part after the other; each part gets
those between its two cuts.

This is code next to the kernel in the same object file, which holds no addresses: it is cached with the kernel, and
compiling it takes a fortieth of a second.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.callconv import RETCODE_NONE, RETCODE_OK, excinfo_ptr_t
from numba.core.callwrapper import PyCallWrapper
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.lowering import Lower
from numba.core.typed_passes import BaseNativeLowering, NativeLowering

I32, I64 = ir.IntType(32), ir.IntType(64)
POINTER = ir.IntType(8).as_pointer()
MOST = 1024
"""Largest number of parts."""
SHARED = ".shared"
"""What the name of an entry has more than that of its kernel."""


class _Places(NamedTuple):
    """Places in a plan, a table of whole numbers of 64 bits that says how a range is shared."""

    run: int = 0
    """Address of a C function (address of the plan, body, pack): calls body(k, pack) for all parts k."""
    parts: int = 1
    results: int = 2
    """Address of what the parts returned; of the entry's own."""
    uneven: int = 3
    """Whether ends and cuts are given; otherwise parts are equally long."""
    body: int = 4
    pack: int = 5
    """What is being run; of the threads' own."""
    clock: int = 6
    """Room for the time, two numbers; of the threads' own."""
    threads: int = 8
    """Number of threads, of which each has one part of its own; of the threads' own."""
    next: int = 16
    """The first of the other parts that no thread has taken; of the threads' own."""
    ends: int = 24
    """Where parts begin and end."""
    cuts: int = 24 + MOST + 1
    """Where the runs of a part begin and end."""
    boxes: int = 24 + 2 * (MOST + 1)
    """Addresses of what each thread looks at; of the threads' own."""
    size: int = 24 + 3 * (MOST + 1)


Plan = _Places()


def shared(decorate: Any, function: Callable, **options: Any) -> Any:
    """A function of a range, compiled by numba's decorator with this entry."""
    made = decorate(nogil=True, pipeline_class=Compiler, **options)(function)
    made.shared = True
    return made


def is_shared(kernel: Any) -> bool:
    """Whether a kernel has this entry."""
    return getattr(kernel, "shared", False)


def alone(kernel: Callable, count: int, *args: Any, weight: float = 1, pieces: int | None = None) -> list:
    """What [kernel(0, count, *args)] returns: one thread's form of `kernels.threads.over`."""
    return [kernel(0, count, *args)]


def _constant(value: int) -> ir.Constant:
    return ir.Constant(I64, value)


def _read(builder, plan, place):
    """A number of a plan; place: a constant or a value."""
    return builder.load(_at(builder, plan, place))


def _at(builder, plan, place):
    return builder.gep(plan, [_constant(place) if isinstance(place, int) else place])


class _Pack:
    """What the parts of one call share: a structure on the stack of the thread that calls."""

    PLAN, RESULTS, ERRORS, CODES = range(4)
    ARGUMENTS = 4

    def __init__(self, kernel: ir.Function) -> None:
        self.result = kernel.args[0].type
        self.arguments = [argument.type for argument in kernel.args[4:]]
        heads = [I64.as_pointer(), self.result, excinfo_ptr_t.as_pointer(), I32.as_pointer()]
        self.type = ir.LiteralStructType([*heads, *self.arguments])


def _entry(context, module, kernel, fndesc) -> ir.Function:
    """A function that is called like the kernel, and shares it among threads if it is asked to."""
    pack = _Pack(kernel)
    body = _body(context, module, kernel, fndesc, pack)
    entry = ir.Function(module, kernel.function_type, fndesc.llvm_func_name + SHARED)
    _leave_as_it_is(entry)
    entry.linkage = "external"  # for `kernels/in_a_row.py`
    builder = ir.IRBuilder(entry.append_basic_block("entry"))
    result, error, first, last = entry.args[:4]
    with builder.if_then(builder.icmp_signed(">=", first, _constant(0)), likely=True):
        builder.ret(builder.call(kernel, entry.args, attrs=("noinline",)))
    plan = builder.inttoptr(builder.neg(first), I64.as_pointer())
    parts = _read(builder, plan, Plan.parts)
    even = builder.icmp_signed("==", _read(builder, plan, Plan.uneven), _constant(0))
    with (
        builder.if_then(even),
        cgutils.for_range(builder, builder.add(parts, _constant(1)), intp=I64) as loop,
    ):
        end = builder.sdiv(builder.mul(last, loop.index), parts)
        builder.store(end, _at(builder, plan, builder.add(loop.index, _constant(Plan.ends))))
    size = context.get_abi_sizeof(pack.result.pointee)
    malloc = cgutils.get_or_insert_function(module, ir.FunctionType(POINTER, [I64]), "malloc")
    space = builder.call(malloc, [builder.mul(parts, _constant(size))])
    cgutils.memset(builder, space, builder.mul(parts, _constant(size)), 0)
    codes = builder.alloca(I32, size=parts)
    errors = builder.alloca(excinfo_ptr_t, size=parts)
    held = builder.alloca(pack.type)
    heads = [plan, builder.bitcast(space, pack.result), errors, codes]
    for k, value in enumerate([*heads, *entry.args[4:]]):
        builder.store(value, cgutils.gep_inbounds(builder, held, 0, k))
    run_type = ir.FunctionType(ir.VoidType(), [I64, I64, I64])
    run = builder.inttoptr(_read(builder, plan, Plan.run), run_type.as_pointer())
    builder.call(run, [builder.ptrtoint(v, I64) for v in (plan, body, held)])
    with cgutils.for_range(builder, parts, intp=I64) as loop:
        code = builder.load(builder.gep(codes, [loop.index]))
        with builder.if_then(_failed(builder, code), likely=False):
            _free(builder, module, space)
            builder.store(builder.load(builder.gep(errors, [loop.index])), error)
            builder.ret(code)
    builder.store(builder.ptrtoint(space, I64), _at(builder, plan, Plan.results))
    builder.store(builder.load(heads[1]), result)
    builder.ret(RETCODE_OK)
    return entry


def _leave_as_it_is(function: ir.Function) -> None:
    """Have LLVM neither improve nor inline a function that moves arguments about: that takes longer than a kernel."""
    function.linkage = "internal"
    function.attributes.add("noinline")
    function.attributes.add("optnone")


def _failed(builder, code):
    return builder.and_(
        builder.icmp_signed("!=", code, RETCODE_OK), builder.icmp_signed("!=", code, RETCODE_NONE)
    )


def _free(builder, module, space) -> None:
    free = cgutils.get_or_insert_function(module, ir.FunctionType(ir.VoidType(), [POINTER]), "free")
    builder.call(free, [space])


def _body(context, module, kernel, fndesc, pack) -> ir.Function:
    """body(k, address of the pack): call the kernel for part k."""
    body = ir.Function(module, ir.FunctionType(ir.VoidType(), [I64, I64]), fndesc.llvm_func_name + ".part")
    _leave_as_it_is(body)
    builder = ir.IRBuilder(body.append_basic_block("entry"))
    part, held = body.args[0], builder.inttoptr(body.args[1], pack.type.as_pointer())

    def shared(k):
        return builder.load(cgutils.gep_inbounds(builder, held, 0, k))

    def of_part(table):
        place = builder.add(part, _constant(table))
        plan = shared(_Pack.PLAN)
        return _read(builder, plan, place), _read(builder, plan, builder.add(place, _constant(1)))

    arguments = [shared(_Pack.ARGUMENTS + k) for k in range(len(pack.arguments))]
    if _has_runs(fndesc):
        _take_runs(context, builder, fndesc.argtypes[2], arguments, of_part(Plan.cuts))
    result, error = (builder.gep(shared(k), [part]) for k in (_Pack.RESULTS, _Pack.ERRORS))
    code = builder.call(kernel, [result, error, *of_part(Plan.ends), *arguments], attrs=("noinline",))
    builder.store(code, builder.gep(shared(_Pack.CODES), [part]))
    builder.ret_void()
    return body


def _has_runs(fndesc) -> bool:
    return len(fndesc.args) > 2 and fndesc.args[2] == "runs"


def _take_runs(context, builder, kind, arguments, cuts) -> None:
    """Of the array `runs`, which comes first among the flattened arguments, the rows between two cuts."""
    fields = list(context.data_model_manager[kind]._fields)
    if not (isinstance(kind, types.Array) and kind.ndim == 2 and kind.dtype == types.int64):
        raise TypeError(f"runs: {kind}, must be an array (k, 2) of whole numbers")
    begin, end = cuts
    rows = builder.sub(end, begin)
    data, items, shape = (fields.index(name) for name in ("data", "nitems", "shape"))
    arguments[data] = builder.gep(arguments[data], [builder.mul(begin, _constant(2))])
    arguments[items] = builder.mul(rows, _constant(2))
    arguments[shape] = rows


class _Wrapper(PyCallWrapper):
    """Numba's entry, but for the list of results."""

    def build_wrapper(self, api, builder, closure, args, kws):
        given = api.from_native_return

        def from_native_return(kind, value, env_manager):
            first = api.long_as_longlong(api.tuple_getitem(args, 0))
            with builder.if_then(builder.icmp_signed("<", first, _constant(0)), likely=False):
                plan = builder.inttoptr(builder.neg(first), I64.as_pointer())
                parts = _read(builder, plan, Plan.parts)
                stored = self.func.args[0].type
                space = builder.inttoptr(_read(builder, plan, Plan.results), stored)
                found = api.list_new(parts)
                with cgutils.for_range(builder, parts, intp=I64) as loop:
                    raw = builder.load(builder.gep(space, [loop.index]))
                    one = self.context.get_returned_value(builder, self.fndesc.restype, raw)
                    api.list_setitem(found, loop.index, given(kind, one, env_manager))
                _free(builder, self.module, builder.bitcast(space, POINTER))
                builder.ret(found)
            return given(kind, value, env_manager)

        api.from_native_return = from_native_return
        super().build_wrapper(api, builder, closure, args, kws)


class _Lower(Lower):
    """Numba's last step before machine code, with the entry of this module."""

    def create_cpython_wrapper(self, release_gil=False):
        context, fndesc = self.context, self.fndesc
        if fndesc.argtypes[:2] != (types.int64, types.int64):
            super().create_cpython_wrapper(release_gil)
            return
        module = context.create_module("wrapper")
        kind = context.call_conv.get_function_type(fndesc.restype, fndesc.argtypes)
        kernel = ir.Function(module, kind, fndesc.llvm_func_name)
        entry = _entry(context, module, kernel, fndesc)
        _Wrapper(context, module, entry, fndesc, self.env, self.call_helper, release_gil).build()
        self.library.add_ir_module(module)


@register_pass(mutates_CFG=True, analysis_only=False)
class _Lowering(BaseNativeLowering):
    _name: Any = "lowering_of_shared_ranges"

    @property
    def lowering_class(self):
        return _Lower


class Compiler(CompilerBase):
    """Numba's compiler, with the entry of this module: the `pipeline_class` of a kernel whose range is shared."""

    def define_pipelines(self):
        """Numba's passes, one of them replaced."""
        manager = DefaultPassBuilder.define_nopython_pipeline(self.state, "shared_ranges")
        manager.passes = [
            (_Lowering if made is NativeLowering else made, what) for made, what in manager.passes
        ]
        manager._finalized = False
        manager.finalize()
        return [manager]
