"""`python -m fba`: the same as the `fba` command."""

from fba.cli.main import main

main()
