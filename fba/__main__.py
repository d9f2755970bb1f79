"""Starts the `fba` command: the installed program, and `python -m fba`."""

from __future__ import annotations

from fba.cli.startup import leave_on_interrupt


def main() -> None:
    """Run the command line of this process and exit.

    Ctrl+C is taken care of first: the imports of the command line take some 0.1 s.
    """
    leave_on_interrupt()
    from fba.cli.main import main as run

    run()


if __name__ == "__main__":
    main()
