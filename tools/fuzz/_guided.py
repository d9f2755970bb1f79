"""Coverage-guided fuzzing with atheris: inputs that reach new code are kept and mutated further.

Compiled loops run as Python here, so that their branches count, too; that takes 20 to 100 times longer.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from importlib.util import find_spec
from pathlib import Path
from re import findall

from fba.errors import OptionError
from tools.fuzz._campaign import Campaign, environment, minimise_in_processes, save
from tools.fuzz._engine import Finding, Report
from tools.fuzz.corpus import read_corpus
from tools.fuzz.targets import Target

MOST_BYTES = 20_000


def run_guided(campaign: Campaign, say: Callable[[str], None]) -> list[Report]:
    """Run all targets; return their reports, in which only the number of inputs and the findings are set."""
    if find_spec("atheris") is None:
        raise OptionError("--guided needs atheris: ./dev fuzz --guided sets it up, on Linux with x86-64")
    total = sum(target.share for target in campaign.targets)

    def one(target: Target) -> Report:
        seconds = (
            60 * (campaign.minutes or 0) * min(campaign.jobs, len(campaign.targets)) * target.share / total
        )
        report = _run_target(campaign, target, seconds)
        say(report.line())
        for finding in report.findings:
            say(save(finding, campaign.findings))
        return report

    targets = [target for target in campaign.targets if not target.environment]
    with ThreadPoolExecutor(max_workers=campaign.jobs) as pool:
        return list(pool.map(one, targets))


def _run_target(campaign: Campaign, target: Target, seconds: float) -> Report:
    with tempfile.TemporaryDirectory(prefix="fba-fuzz-") as name:
        corpus, found = Path(name) / "corpus", Path(name) / "found"
        corpus.mkdir()
        found.mkdir()
        for number, data in enumerate(read_corpus(target, campaign.corpus)):
            (corpus / str(number)).write_bytes(data)
        limits = [
            f"-max_total_time={max(1, round(seconds))}",
            f"-seed={campaign.seed + 1}",
            f"-max_len={MOST_BYTES}",
        ]
        limits += ["-timeout=60", "-rss_limit_mb=4096", f"-artifact_prefix={found}/", "-print_final_stats=1"]
        done = subprocess.run(
            [sys.executable, "-m", "tools.fuzz._guided_worker", target.name, str(corpus), *limits],
            env={**environment(target), "NUMBA_DISABLE_JIT": "1"}, capture_output=True, check=False,
        )  # fmt: skip
        words = done.stderr.decode("utf-8", "replace") + done.stdout.decode("utf-8", "replace")
        report = Report(target.name)
        executed = findall(r"stat::number_of_executed_units: (\d+)", words)
        report.count = int(executed[-1]) if executed else 0
        for number, path in enumerate(sorted(found.iterdir())):
            data = path.read_bytes()
            kind = path.name.partition("-")[0]
            smaller = minimise_in_processes(target, data)
            report.findings.append(
                Finding(target.name, campaign.seed, number, kind, words[-4000:], data, smaller)
            )
        if done.returncode and not report.findings:
            raise RuntimeError(f"atheris ended with status {done.returncode}:\n{words[-4000:]}")
        return report
