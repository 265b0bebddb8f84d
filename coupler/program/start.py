"""What every command does before it loads NumPy, Numba or YADE."""


def one_thread() -> None:
    """One thread unless the user asks, one instruction set, and the kernels of the present sources."""
    from coupler.program.arithmetic import fix_arithmetic
    from coupler.program.kernel_cache import use_kernel_cache

    fix_arithmetic()
    use_kernel_cache()
