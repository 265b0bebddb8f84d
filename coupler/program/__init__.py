"""What every command needs: errors and exit codes, child processes, versions, and terminal output.

errors, failures        errors, and the exit of a command after one
start, arithmetic       libraries and instruction set, fixed before NumPy is loaded, so that results have the same bits
threads, memory         the number of threads of a run, and the memory that it may take
control_groups          what a container or a batch job gives this process of the machine
kernel_cache            where compiled kernels are kept
kernel_pack             compiled kernels as one file, for other machines
process, provenance     child processes of this very program; program, packages and machine of a result
extras, terminal        optional packages; printed output
quantities              numbers with their units, for people

Imports nothing of the project.  Every chapter of coupler may import it.
"""
