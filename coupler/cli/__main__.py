"""`python -m coupler.cli`"""

from coupler.commands.cli import main

main()
