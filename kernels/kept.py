"""Kernels that the folder of kernels holds: what of them is read when a process needs one.

Numba keeps a kernel twice, as machine code and as code of LLVM that goes into kernels which call it, and reads both
whenever it loads one; that takes a third of the time, for nothing unless something is compiled with it. Here the second
is read when it is asked for. Numba looks in it, too, for what the machine code contains, whose own table of names says
the same.

Before it looks for a kernel, Numba also loads all that it knows of Python and NumPy. Only the compiler needs that, and
loads it itself where it has to compile; it takes longer than to read all kernels of a run. What kernels call at run
time, to make arrays, is set up here.
"""

from __future__ import annotations

from typing import Any

import llvmlite.binding as llvm
from numba.core.caching import Cache
from numba.core.codegen import JITCodeLibrary, JITCPUCodegen
from numba.core.runtime import rtsys


class KeptLibrary(JITCodeLibrary):
    """The code of a kernel."""

    _object, _bitcode = b"", b""

    @classmethod
    def _unserialize(cls, codegen: Any, state: tuple) -> Any:
        name, kind, data = state
        if kind != "object":
            return super()._unserialize(codegen, state)
        self = codegen.create_library(name)
        self._object, self._bitcode = data
        self.enable_object_caching()
        self._set_compiled_object(self._object)
        self._finalize_final_module()
        return self

    def get_pointer_to_function(self, name: str) -> int:
        """Address of a function of the kernel; 0: it has none of this name."""
        if not self._object:
            return super().get_pointer_to_function(name)
        found = name.encode() + b"\0" in self._object
        return self._codegen._engine.get_function_address(name) if found else 0

    def _get_module_for_linking(self) -> Any:
        if self._bitcode:
            self._shared_module = llvm.parse_bitcode(self._bitcode)
            self._codegen._engine._load_defined_symbols(self._shared_module)
            self._bitcode = b""
        return super()._get_module_for_linking()


def load_overload(cache: Any, sig: Any, target_context: Any) -> Any:
    """What a cache of Numba holds of a kernel for the types of its arguments; None: nothing."""
    rtsys.initialize(target_context)
    with cache._guard_against_spurious_io_errors():
        return cache._load_overload(sig, target_context)


def read_less() -> None:
    """From now on."""
    JITCPUCodegen._library_class = KeptLibrary
    Cache.load_overload = load_overload  # type: ignore[method-assign]
