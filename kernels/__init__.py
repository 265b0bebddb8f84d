"""How numerical kernels are compiled (`decorators.py`), read when they are compiled already (`kept.py`) and run on
several threads (`threads.py`), also several in a row (`in_a_row.py`), how they take four numbers at a time (`lanes.py`)
and round a product and a sum together (`fused.py`), and how a process that makes steps keeps the memory that it frees
(`memory.py`); it knows none of the packages that it serves."""
