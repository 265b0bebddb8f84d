"""How numerical kernels are compiled (`decorators.py`) and run on several threads (`threads.py`); it knows none of the
packages that it serves. Whoever imports it keeps the memory that it frees (`memory.py`)."""

from kernels.memory import keep_memory

keep_memory()
