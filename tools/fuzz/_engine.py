"""Runs the inputs of one target, one after another, and holds each to its limits of time and memory."""

from __future__ import annotations

import mmap
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from random import Random
from typing import Any

from tools.fuzz._minimise import minimise
from tools.fuzz._mutation import mutate
from tools.fuzz._outcome import ContractError, Outcome
from tools.fuzz.targets import Target

MOST_SECONDS = 3.0
"""Processor time of an input, seconds: generous, as machines differ."""
MOST_SECONDS_PER_BYTE = 0.002
"""Further processor time for each byte of an input, seconds."""
SEED_SECONDS = 60.0
"""Processor time of a seed of any length, seconds: a search on head and body takes several."""
MOST_MEMORY = 200_000_000
"""Memory of an input beyond that of the process before it, bytes."""
MOST_MEMORY_PER_BYTE = 20
"""Further memory for each byte of an input, bytes."""
MINIMISED_SECONDS = 15.0
RANDOM_BYTES = 8
"""Size of the inputs of targets whose inputs are random."""


@dataclass(frozen=True)
class Finding:
    """An input for which the code broke its contract.

    seed and number make it again; minimised: a smaller one that fails in the same way. kind: the exception
    and the line that raised it.
    """

    target: str
    seed: int
    number: int
    kind: str
    reason: str
    data: bytes = b""
    minimised: bytes = b""


@dataclass
class Report:
    """Counts of a run.

    planes: planes, of streams, that were read in whole or in part at or behind the first mutated byte. worst:
    most processor time that an input took, in seconds, and `slowest` its number. repeated: inputs that failed
    in the same way as a finding.
    """

    target: str
    count: int = 0
    accepted: int = 0
    refused: int = 0
    salvaged: int = 0
    planes: int = 0
    worst: float = 0.0
    slowest: int = -1
    repeated: int = 0
    findings: list[Finding] = field(default_factory=list)

    def add(self, other: Report) -> None:
        """Add the counts of a later part of the same run."""
        for name in ("count", "accepted", "refused", "salvaged", "planes", "repeated"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        if other.worst > self.worst:
            self.worst, self.slowest = other.worst, other.slowest
        known = {finding.kind for finding in self.findings}
        self.findings += [finding for finding in other.findings if finding.kind not in known]

    def to_dict(self) -> dict[str, Any]:
        """Return the counts as JSON can hold them, the findings without their data."""
        counts = asdict(self)
        counts["findings"] = [
            {key: value for key, value in asdict(one).items() if key not in ("data", "minimised")}
            for one in self.findings
        ]
        return counts

    def line(self) -> str:
        """Return the counts in one line."""
        planes = f" ({self.planes} mutated planes)" if self.planes else ""
        salvaged = f", {self.salvaged} of these salvaged in part" if self.salvaged else ""
        return (
            f"{self.target}: {self.count} inputs{planes}, {self.accepted} accepted, {self.refused} refused"
            f"{salvaged}; "
            f"slowest {1000 * self.worst:.0f} ms (number {self.slowest}); {len(self.findings)} findings"
        )


def run(
    target: Target,
    corpus: Sequence[bytes],
    *,
    count: int | None = None,
    seconds: float | None = None,
    seed: int = 0,
    first: int = 0,
    progress: Callable[[int], None] = lambda number: None,
) -> Report:
    """Check the mutations first..first + count of a seed, or as many as the seconds allow.

    corpus: the files that are mutated; they are checked themselves, too, before (with numbers below 0), which
    compiles functions that are not compiled yet. progress: called with each input's number before it runs.
    """
    report = Report(target.name)
    with tempfile.TemporaryDirectory(prefix="fba-fuzz-") as folder:
        check = Check(target, Path(folder))
        for number, data in enumerate(corpus, -len(corpus)):
            progress(number)
            _record(report, check, data, data, seed, number)
        report.worst, report.slowest = 0.0, -1  # of compiling
        check.limit()
        end = None if seconds is None else time.monotonic() + seconds
        for number in _numbers(first, count, end):
            progress(number)
            data, original = mutated(target, corpus, seed, number)
            _record(report, check, data, original, seed, number)
    return report


def run_files(target: Target, files: Iterable[bytes]) -> Report:
    """Check these inputs as they are."""
    report = Report(target.name)
    with tempfile.TemporaryDirectory(prefix="fba-fuzz-") as folder:
        check = Check(target, Path(folder))
        for number, data in enumerate(files):
            _record(report, check, data, b"", 0, number, minimising=False)
    return report


def mutated(target: Target, corpus: Sequence[bytes], seed: int, number: int) -> tuple[bytes, bytes]:
    """Return the input of this number, and the file that it was made from."""
    if number < 0:
        return corpus[number], corpus[number]
    if target.random:
        return Random(f"{seed} {number}").randbytes(RANDOM_BYTES), b""
    return mutate(corpus, Random(f"{seed} {number}"), target.words)


def _numbers(first: int, count: int | None, end: float | None) -> Iterator[int]:
    number = first
    while (count is None or number < first + count) and (end is None or time.monotonic() < end):
        yield number
        number += 1


def _record(
    report: Report,
    check: Check,
    data: bytes,
    original: bytes,
    seed: int,
    number: int,
    minimising: bool = True,
) -> None:
    """Check an input and add its outcome."""
    report.count += 1
    try:
        outcome = check(data)
    except Exception as error:  # anything but an FbaError is a finding
        kind = kind_of(error)
        if any(kind == finding.kind for finding in report.findings):
            report.repeated += 1
            return
        smaller = minimise(data, check.fails_with(kind), MINIMISED_SECONDS) if minimising else data
        reason = "".join(traceback.format_exception(error, limit=-6))
        report.findings.append(Finding(report.target, seed, number, kind, reason, data, smaller))
        return
    report.accepted += outcome.accepted
    report.refused += not outcome.accepted
    report.salvaged += outcome.salvaged
    if outcome.planes:
        same = 8 * _common(data, original)
        report.planes += sum(end > same for end in outcome.planes)
    if check.seconds > report.worst:
        report.worst, report.slowest = check.seconds, number


def _common(one: bytes, other: bytes) -> int:
    """Return the number of bytes that both begin with."""
    shorter = min(len(one), len(other))
    return next((position for position in range(shorter) if one[position] != other[position]), shorter)


class Check:
    """Checks one input within limits of time and, after `limit`, of memory. seconds: that the last took.

    most_seconds: processor time that any input may take, whatever its size.
    """

    def __init__(self, target: Target, folder: Path, most_seconds: float = MOST_SECONDS) -> None:
        self.seconds = 0.0
        self._most_seconds = SEED_SECONDS if target.random else most_seconds
        self._check, self._folder = target.load(), folder
        self._limited = False

    def limit(self) -> None:
        """Limit memory from now on, not counting functions that are already compiled."""
        self._limited = True

    def __call__(self, data: bytes) -> Outcome:
        """Check an input; raise for a finding."""
        most_before, before = _peak_memory(), _memory()
        outcome = self._timed(data)
        most_seconds = self._most_seconds + MOST_SECONDS_PER_BYTE * len(data)
        if self.seconds > most_seconds:
            self._timed(data)  # whatever happens once, as compiling does, is no fault of the input
            if self.seconds > most_seconds:
                raise ContractError(f"{len(data)} bytes took {self.seconds:.1f} s of processor time")
        most = _peak_memory()
        if self._limited and most > most_before:
            taken = most - before
            if taken > MOST_MEMORY + MOST_MEMORY_PER_BYTE * len(data):
                raise ContractError(f"{len(data)} bytes took {taken / 1e6:.0f} MB of memory")
        return outcome

    def _timed(self, data: bytes) -> Outcome:
        begin = time.process_time()
        try:
            return self._check(data, self._folder)
        finally:
            self.seconds = time.process_time() - begin

    def fails_with(self, kind: str) -> Callable[[bytes], bool]:
        """Return whether an input fails in this way."""

        def fails(data: bytes) -> bool:
            try:
                self(data)
            except Exception as error:
                return kind_of(error) == kind
            return False

        return fails


def kind_of(error: BaseException) -> str:
    """Return the type of an exception and our line that raised it; of a broken contract, its words."""
    if isinstance(error, ContractError):
        words = "".join("#" if letter.isdigit() else letter for letter in str(error))
        return f"ContractError: {words[:40]}"
    place = ""
    for frame in traceback.extract_tb(error.__traceback__):
        if "/fba" in frame.filename.replace("\\", "/"):
            place = f"{Path(frame.filename).name}:{frame.lineno}"
    return f"{type(error).__name__} in {place}"


def _memory() -> int:
    """Return the memory in bytes that this process has now; where the system does not say, its peak."""
    try:
        with open("/proc/self/statm", "rb") as file:
            return int(file.read().split()[1]) * mmap.PAGESIZE
    except OSError:
        return _peak_memory()


def _peak_memory() -> int:
    """Return the most memory in bytes that this process has had; 0 where the system does not say."""
    try:
        import resource
    except ImportError:
        return 0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak
