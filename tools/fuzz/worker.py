"""A process that checks inputs of one target: `tools.fuzz` starts and watches it.

It writes the number of the input that it is at into a small file, so that the watcher knows which one made it
crash or hang, and prints its report as a line of JSON.
"""

from __future__ import annotations

import argparse
import faulthandler
import json
import mmap
import struct
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

from tools.fuzz._engine import Report, run, run_files
from tools.fuzz.corpus import read_corpus
from tools.fuzz.targets import find_target

NUMBER = struct.Struct("<q")
ADDRESS_SPACE = 6_000_000_000
"""Bytes of addresses that the process may have: asking for more is a MemoryError, which is a finding."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return 1 if there were findings."""
    parser = argparse.ArgumentParser(prog="python -m tools.fuzz.worker")
    parser.add_argument("target")
    parser.add_argument("--corpus", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int)
    parser.add_argument("--seconds", type=float)
    parser.add_argument("--progress", type=Path, help="file for the number of the input")
    parser.add_argument("--findings", type=Path, help="folder for inputs that fail")
    parser.add_argument("files", nargs="*", type=Path)
    options = parser.parse_args(arguments)
    faulthandler.enable()
    _limit_addresses()
    target = find_target(options.target)
    if options.files:
        report = run_files(target, [path.read_bytes() for path in options.files])
    else:
        report = run(
            target,
            read_corpus(target, options.corpus),
            count=options.count,
            seconds=options.seconds,
            seed=options.seed,
            first=options.first,
            progress=_progress(options.progress),
        )
    if options.findings:
        _save(report, options.findings)
    sys.stdout.write(json.dumps(report.to_dict()) + "\n")
    return 1 if report.findings else 0


def _limit_addresses() -> None:
    """Limit the addresses of this process, on Linux."""
    with suppress(ImportError, ValueError, OSError):  # no such module on Windows; or a lower limit is set
        import resource

        if sys.platform == "linux":
            resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, resource.RLIM_INFINITY))


def _progress(path: Path | None) -> Callable[[int], None]:
    """Return the function that writes a number into the file, which must be there."""
    if path is None:
        return lambda number: None
    with path.open("r+b") as file:
        shared = mmap.mmap(file.fileno(), NUMBER.size)
    return lambda number: NUMBER.pack_into(shared, 0, number)


def file_name(target: str, seed: int, number: int) -> str:
    """Return the name of the file that an input that fails is saved in."""
    return f"{target.replace(':', '-')}-seed{seed}-{number}"


def _save(report: Report, folder: Path) -> None:
    """Write the inputs of all findings."""
    for finding in report.findings:
        name = file_name(finding.target, finding.seed, finding.number)
        (folder / f"{name}.whole").write_bytes(finding.data)
        (folder / name).write_bytes(finding.minimised)


if __name__ == "__main__":
    raise SystemExit(main())
