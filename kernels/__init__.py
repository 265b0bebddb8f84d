"""How numerical kernels are compiled (`decorators.py`) and run on several threads (`threads.py`); it knows none of the
packages that it serves."""
