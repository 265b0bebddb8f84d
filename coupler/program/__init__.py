"""What a command needs whatever it computes: errors and exit codes, child processes, versions, text for people.

errors, failures        what can go wrong, and how a command ends then
start, arithmetic       libraries and instruction set, fixed before NumPy is loaded, so that results have the same bits
threads                 how many threads a run works with
kernel_cache            where compiled kernels are kept
process, provenance     child processes of this very program; program, packages and machine of a result
extras, terminal        optional packages; what is printed

Imports nothing of the project.  Every chapter of coupler may import it.
"""
