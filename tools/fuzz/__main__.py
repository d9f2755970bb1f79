"""`python -m tools.fuzz`: fuzz all targets or some, or check files that were found before."""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from fba.errors import FbaError
from tools.fuzz._campaign import Campaign, environment, run_campaign, worker_command
from tools.fuzz._guided import run_guided
from tools.fuzz.targets import Target, find_target, targets


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return 1 if there were findings, 2 for wrong arguments."""
    parser = argparse.ArgumentParser(
        prog="./dev fuzz",
        description="Feed mutated streams and files to everything that reads bytes: each must give a "
        "result or an FbaError, in bounded time and memory.",
        epilog="Targets: " + "; ".join(f"{one.name}: {one.description}" for one in targets()) + ".",
    )
    parser.add_argument("--minutes", type=float, default=10, help="for all targets together (default 10)")
    parser.add_argument("--count", type=int, help="inputs for each target, instead of --minutes")
    parser.add_argument(
        "--target", action="append", metavar="NAME", help="one target; may be repeated (default: all)"
    )
    parser.add_argument("--seed", type=int, default=0, help="number of the series of mutations (default 0)")
    parser.add_argument("--first", type=int, default=0, metavar="NUMBER", help="number of the first mutation")
    parser.add_argument(
        "--jobs", type=int, default=os.cpu_count() or 1, help="processes side by side (default: cores)"
    )
    parser.add_argument(
        "--guided", action="store_true", help="choose inputs by the code that they reach (atheris, Linux)"
    )
    parser.add_argument(
        "--corpus", type=Path, metavar="FOLDER", help="files to mutate, one folder for each target"
    )
    parser.add_argument(
        "--findings", type=Path, default=Path("fuzz-findings"), metavar="FOLDER",
        help="folder for inputs that fail (default fuzz-findings)",
    )  # fmt: skip
    parser.add_argument(
        "files", nargs="*", type=Path, help="check these files with the one target, and nothing else"
    )
    options = parser.parse_args(arguments)
    try:
        chosen = [find_target(name) for name in options.target] if options.target else list(targets())
    except FbaError as error:
        parser.error(str(error))
    if options.files:
        if len(chosen) != 1:
            parser.error("files need one --target")
        return _check_files(chosen[0], options.files)
    campaign = Campaign(
        chosen, options.seed, options.first, options.count, options.minutes, max(1, options.jobs),
        options.corpus,
        options.findings,
    )  # fmt: skip
    try:
        reports = (run_guided if options.guided else run_campaign)(campaign, _say)
    except FbaError as error:
        parser.error(str(error))
    found = sum(len(report.findings) for report in reports)
    planes = sum(report.planes for report in reports)
    _say(f"{sum(report.count for report in reports)} inputs, {planes} mutated planes; {found} findings")
    return 1 if found else 0


def _check_files(target: Target, files: Sequence[Path]) -> int:
    """Check files in a process as the target needs it; return 0 if all hold, else 1."""
    failed = 0
    for path in files:
        done = subprocess.run(
            worker_command(target, str(path)),
            env=environment(target),
            capture_output=True,
            text=True,
            check=False,
        )
        failed += done.returncode != 0
        verdict = "holds" if done.returncode == 0 else "FAILS"
        _say(f"{path}: {verdict}" + (f"\n{_reasons(done)}" if done.returncode else ""))
    return 1 if failed else 0


def _reasons(done: subprocess.CompletedProcess[str]) -> str:
    """Return why a worker failed."""
    import json

    lines = done.stdout.splitlines()
    if done.returncode == 1 and lines:
        return "\n".join(finding["reason"] for finding in json.loads(lines[-1])["findings"])
    return f"{done.stderr[-4000:]}\nthe process ended with status {done.returncode}"


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    raise SystemExit(main())
