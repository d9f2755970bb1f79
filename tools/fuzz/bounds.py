"""`python -m tools.fuzz.bounds`: run all that is compiled with the bounds of every access checked.

Three parts: the test suite, random performances encoded in every manner, and mutated files. All run with
`NUMBA_BOUNDSCHECK=1`, under which compiled code raises IndexError where it would read or write beside an
array.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from fba.compiled import is_compiled
from tools.fuzz._campaign import Campaign, run_campaign
from tools.fuzz._engine import Report
from tools.fuzz.targets import targets

CHECKED = "NUMBA_BOUNDSCHECK"
PERFORMANCES, MUTANTS = 20_000, 500_000
TOLD_EVERY = 30.0
"""Seconds from one line of progress to the next."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return 1 if there were findings, 2 for wrong arguments."""
    parser = argparse.ArgumentParser(
        prog="./dev bounds",
        description="Run the test suite, random performances through every preset of the encoder, and "
        "mutated files through every reader, with the bounds of every array access checked in compiled "
        "code. All of it takes hours; --performances, --mutants and --tests make it shorter.",
    )
    parser.add_argument(
        "--performances", type=int, default=PERFORMANCES, metavar="N",
        help=f"faces and bodies to encode and decode (default {PERFORMANCES:,})",
    )  # fmt: skip
    parser.add_argument(
        "--mutants", type=int, default=MUTANTS, metavar="N",
        help=f"mutated files, of all targets of ./dev fuzz together (default {MUTANTS:,})",
    )  # fmt: skip
    parser.add_argument(
        "--tests",
        nargs="*",
        default=["tests"],
        metavar="PATH",
        help="tests to run (default: all); none without PATH",
    )
    parser.add_argument("--seed", type=int, default=0, help="of performances and mutations (default 0)")
    parser.add_argument("--first", type=int, default=0, metavar="NUMBER", help="number of the first of each")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="processes (default: cores)")
    parser.add_argument(
        "--findings", type=Path, default=Path("fuzz-findings"), metavar="FOLDER",
        help="folder for inputs that fail (default fuzz-findings)",
    )  # fmt: skip
    options = parser.parse_args(arguments)
    if min(options.performances, options.mutants) < 0:
        parser.error("--performances and --mutants are numbers from 0 up")
    if not is_compiled():
        parser.error("nothing is compiled here: numba is missing or switched off")
    with _caches():
        summary = []
        if options.tests:
            _say(f"tests with bounds checked: {' '.join(options.tests)}")
            status = _run_tests(options.tests, options.jobs)
            summary.append(
                ("tests", status == 0, "passed" if status == 0 else f"failed: status {status} of pytest")
            )
        plan = _counts(options.performances, options.mutants)
        campaign = Campaign(
            [replace(target, environment={CHECKED: "1"}) for target in targets() if plan.get(target.name)],
            options.seed, options.first, None, None, max(1, options.jobs), None, options.findings, plan,
        )  # fmt: skip
        with _progress(campaign):
            reports = run_campaign(campaign, _say) if campaign.targets else []
    for name, random in (("performances", True), ("mutants", False)):
        ran = [report for report in reports if _is_random(report) == random]
        if ran:
            found = sum(len(report.findings) for report in ran)
            planned = sum(plan[report.target] for report in ran)
            # Files of the corpus are checked, too, and count as inputs.
            done = sum(min(report.count, plan[report.target]) for report in ran)
            words = f"{done:,} of {planned:,}, {found} findings"
            summary.append((name, not found and done == planned, words))
    _say("")
    for name, good, words in summary:
        _say(f"{'ok    ' if good else 'FAILED'}  {name}: {words}")
    return 0 if all(good for _, good, _ in summary) else 1


def _is_random(report: Report) -> bool:
    return next(target.random for target in targets() if target.name == report.target)


def _counts(performances: int, mutants: int) -> dict[str, int]:
    """Return by target how many inputs it gets: performances alike, mutants by share."""
    everything = [target for target in targets() if CHECKED not in target.environment]
    result: dict[str, int] = {}
    for total, some in (
        (performances, [target for target in everything if target.random]),
        (mutants, [target for target in everything if not target.random]),
    ):
        shares = sum(target.share for target in some)
        for target in some:
            result[target.name] = total * target.share // shares
        for target in some[: total - sum(result[target.name] for target in some)]:
            result[target.name] += 1
    return result


@contextmanager
def _caches() -> Iterator[None]:
    """Give all child processes checked code and separate caches, kept for the next run."""
    folder = Path(os.environ.get("FBA_BOUNDS_CACHE") or Path.home() / ".cache" / "fba-bounds")
    own = {CHECKED: "1", "NUMBA_CACHE_DIR": str(folder / "code"), "FBA_CACHE": str(folder / "results")}
    before = {name: os.environ.get(name) for name in own}
    os.environ.update(own)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _run_tests(paths: Sequence[str], jobs: int) -> int:
    """Run tests in child processes; return pytest's status."""
    with tempfile.TemporaryDirectory(prefix="fba-bounds-") as folder:
        command = [sys.executable, "-m", "pytest", "-q", "-n", str(jobs), "--dist", "worksteal"]
        command += ["-o", f"cache_dir={folder}", *paths]
        return subprocess.run(command, check=False).returncode


@contextmanager
def _progress(campaign: Campaign) -> Iterator[None]:
    """Say from time to time how far a campaign is, while the block runs."""
    over, begin = threading.Event(), time.monotonic()

    def tell() -> None:
        while not over.wait(TOLD_EVERY):
            at = {name: number - campaign.first for name, number in list(campaign.at.items())}
            done = sum(min(max(number, 0), campaign.counts[name]) for name, number in at.items())
            _say(f"{time.monotonic() - begin:.0f} s: {done:,} of {sum(campaign.counts.values()):,} inputs")

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield
    finally:
        over.set()
        teller.join()


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    raise SystemExit(main())
