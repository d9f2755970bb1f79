"""Runs targets in parallel processes, and saves their findings.

A process that crashes or hangs is a finding as well: the next one goes on behind that input.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from tools.fuzz._engine import Finding, Report, mutated
from tools.fuzz._minimise import minimise
from tools.fuzz.corpus import read_corpus
from tools.fuzz.targets import Target
from tools.fuzz.worker import NUMBER, file_name

HANGING = 120.0
"""Seconds of processor time without progress after which a process hangs."""
COMPILING = 600.0
"""The same for the files of the corpus, the first of which compile the loops."""
WAITING = 30.0
"""Factor for the same by the clock: beside ten busy programs, compiling took over five times as long"""
MINIMISED_SECONDS = 60.0
MOST_DEATHS = 20
"""Processes of one target that may die before the run gives up on it."""


@dataclass(frozen=True)
class Campaign:
    """What to run. count: inputs for each target; without it, minutes divided by the targets' shares.

    counts: inputs by the names of targets, instead of `count`. at: the number of the input that each target
    is at, kept up to date while it runs.
    """

    targets: Sequence[Target]
    seed: int = 0
    first: int = 0
    count: int | None = None
    minutes: float | None = None
    jobs: int = 1
    corpus: Path | None = None
    findings: Path = Path("fuzz-findings")
    counts: Mapping[str, int] = field(default_factory=dict)
    at: dict[str, int] = field(default_factory=dict)

    def count_of(self, target: Target) -> int | None:
        """Return how many inputs a target gets; None where its time decides."""
        return self.counts.get(target.name, self.count)


def run_campaign(campaign: Campaign, say: Callable[[str], None]) -> list[Report]:
    """Run all targets; return their reports. Findings are saved and printed when their target ends."""
    total = sum(target.share for target in campaign.targets)

    def one(target: Target) -> Report:
        seconds = None
        if campaign.count_of(target) is None:
            whole = 60 * (campaign.minutes or 0) * min(campaign.jobs, len(campaign.targets))
            seconds = whole * target.share / total
        report = _run_target(campaign, target, seconds)
        say(report.line())
        for finding in report.findings:
            say(save(finding, campaign.findings))
        return report

    # Long shares first, so that no process runs alone at the end.
    order = sorted(campaign.targets, key=lambda target: -target.share)
    with ThreadPoolExecutor(max_workers=campaign.jobs) as pool:
        return list(pool.map(one, order))


def save(finding: Finding, folder: Path) -> str:
    """Save the input of a finding, minimised, with its story beside it; return the story."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / file_name(finding.target, finding.seed, finding.number)
    path.write_bytes(finding.minimised)
    story = (
        f"{finding.reason.rstrip()}\n\n{finding.target}: {finding.kind}; {len(finding.minimised)} bytes, "
        f"minimised from {len(finding.data)}\n"
        f"to repeat: ./dev fuzz --target {finding.target} {path}\n"
        f"as it was found: ./dev fuzz --target {finding.target} --seed {finding.seed} "
        f"--first {finding.number} --count 1\n"
    )
    path.with_name(path.name + ".txt").write_text(story, encoding="utf-8")
    return story


def _run_target(campaign: Campaign, target: Target, seconds: float | None) -> Report:
    """Run a target until its inputs or its time are used up, with a new process behind each that died."""
    whole = Report(target.name)
    first, count = campaign.first, campaign.count_of(target)
    end = None if seconds is None else time.monotonic() + seconds
    for _ in range(MOST_DEATHS):
        left = None if end is None else max(0.0, end - time.monotonic())
        report, number, words = _run_worker(campaign, target, first, count, left)
        if report is not None:
            whole.add(report)
            return whole
        kind = words.splitlines()[-1]
        if any(kind == finding.kind for finding in whole.findings):
            whole.repeated += 1
        else:
            whole.findings.append(_death(campaign, target, number, kind, words))
        whole.count += number + 1 - first if number >= 0 else 0
        if number < 0:  # a file of the corpus itself
            return whole
        if count is not None:
            count -= number + 1 - first
        first = number + 1
    return whole


def _run_worker(
    campaign: Campaign, target: Target, first: int, count: int | None, seconds: float | None
) -> tuple[Report | None, int, str]:
    """Start a worker and watch it; return its report, or None, the input it died of, and its last words."""
    with tempfile.TemporaryDirectory(prefix="fba-fuzz-") as name:
        folder = Path(name)
        progress = folder / "progress"
        progress.write_bytes(NUMBER.pack(-(1 << 40)))
        arguments = ["--seed", str(campaign.seed), "--first", str(first)]
        arguments += ["--progress", str(progress), "--findings", name]
        arguments += [] if campaign.corpus is None else ["--corpus", str(campaign.corpus)]
        arguments += [] if count is None else ["--count", str(count)]
        arguments += [] if seconds is None else ["--seconds", str(seconds)]
        with (folder / "out").open("wb") as out, (folder / "err").open("wb") as err:
            process = subprocess.Popen(
                worker_command(target, *arguments), stdout=out, stderr=err, env=environment(target)
            )
            try:
                hung = _watch(process, progress, partial(campaign.at.__setitem__, target.name))
            finally:
                process.kill()
                process.wait()
        number = NUMBER.unpack(progress.read_bytes())[0]
        words = (folder / "err").read_text(encoding="utf-8", errors="replace")[-4000:]
        if not hung and process.returncode in (0, 1):
            lines = (folder / "out").read_text(encoding="utf-8").splitlines()
            if lines:
                return _report(json.loads(lines[-1]), folder), number, ""
        if number == -(1 << 40):
            raise RuntimeError(f"the worker of {target.name} did not start:\n{words}")
        how = (
            f"no progress in {HANGING:.0f} s"
            if hung
            else f"the process ended with status {process.returncode}"
        )
        return None, number, f"{words}\n{how}"


def _watch(process: subprocess.Popen[bytes], progress: Path, tell: Callable[[int], None]) -> bool:
    """Wait for a process to end; kill it, with a traceback, and return True if it hangs.

    tell: called with the number of the input that it is at, about once a second.
    """
    before, since, began = None, time.monotonic(), 0.0
    while True:
        try:
            process.wait(timeout=1)
            return False
        except subprocess.TimeoutExpired:
            number = NUMBER.unpack(progress.read_bytes())[0]
            tell(number)
        now, worked = time.monotonic(), _processor_time(process.pid)
        most = HANGING if number >= 0 else COMPILING
        if number != before:
            before, since, began = number, now, worked
        elif worked - began > most or now - since > WAITING * most:
            process.send_signal(signal.SIGABRT)  # faulthandler prints where it is
            process.wait(timeout=30)
            return True


def _processor_time(process: int) -> float:
    """Return the seconds of processor time that a process has taken; 0 where the system does not say."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace")
        user, system = fields.rpartition(")")[2].split()[11:13]
    except (OSError, ValueError):
        return 0.0
    return (int(user) + int(system)) / float(os.sysconf("SC_CLK_TCK"))


def _death(campaign: Campaign, target: Target, number: int, kind: str, words: str) -> Finding:
    """Return the finding of an input that made the process crash or hang, minimised in new processes."""
    corpus = read_corpus(target, campaign.corpus)
    data, _ = mutated(target, corpus, campaign.seed, number)
    smaller = minimise_in_processes(target, data, holding=(0, 1))
    return Finding(target.name, campaign.seed, number, kind, words, data, smaller)


def minimise_in_processes(target: Target, data: bytes, holding: tuple[int, ...] = (0,)) -> bytes:
    """Return a smaller input with which a worker hangs or ends with a status that is not in `holding`."""
    with tempfile.TemporaryDirectory(prefix="fba-fuzz-") as name:
        path = Path(name) / "input"

        def fails(smaller: bytes) -> bool:
            path.write_bytes(smaller)
            try:
                done = subprocess.run(
                    worker_command(target, str(path)), env=environment(target), capture_output=True,
                    timeout=20,
                    check=False,
                )  # fmt: skip
            except subprocess.TimeoutExpired:
                return True
            return done.returncode not in holding

        return minimise(data, fails, MINIMISED_SECONDS)


def worker_command(target: Target, *arguments: str) -> list[str]:
    """Return the command that starts a worker."""
    return [sys.executable, "-m", "tools.fuzz.worker", target.name, *arguments]


def environment(target: Target) -> dict[str, str]:
    """Return the variables of a worker's process."""
    return {**os.environ, **target.environment}


def _report(content: dict[str, object], folder: Path) -> Report:
    """Return a worker's report, with the data of its findings from the folder."""
    findings = content.pop("findings")
    report = Report(**content)  # type: ignore[arg-type]
    assert isinstance(findings, list)
    for one in findings:
        name = file_name(one["target"], one["seed"], one["number"])
        whole, smaller = (folder / f"{name}.whole").read_bytes(), (folder / name).read_bytes()
        report.findings.append(Finding(**one, data=whole, minimised=smaller))
    return report
