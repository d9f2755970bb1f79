"""The command that runs compiled code with its bounds checked, and what compiled functions say of theirs."""

import ast
import os
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from fba.compiled import is_compiled
from tools.fuzz import bounds
from tools.fuzz._campaign import Campaign
from tools.fuzz._engine import Finding, Report
from tools.fuzz.targets import targets

ROOT = Path(__file__).parents[2]
ROOMS = [ROOT / name for name in ("fba", "player", "conformance", "bench", "tools")]
needs_machine_code = pytest.mark.skipif(not is_compiled(), reason="nothing is compiled here")


def writing_functions() -> Iterator[tuple[str, str, str]]:
    """Yield place, own source and the module's docstring of every compiled function that writes."""
    for path in sorted(path for room in ROOMS for path in room.rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        if "@compiled" not in source and "@inlined" not in source:
            continue
        module = ast.parse(source)
        for node in module.body:
            if not isinstance(node, ast.FunctionDef):
                continue
            names = {getattr(decorator, "id", "") for decorator in node.decorator_list}
            writes = any(
                isinstance(one, ast.Subscript) and isinstance(one.ctx, ast.Store) for one in ast.walk(node)
            )
            if names & {"compiled", "inlined"} and writes:
                own = ast.get_source_segment(source, node) or ""
                yield f"{path.relative_to(ROOT)}: {node.name}", own, ast.get_docstring(module) or ""


def test_every_compiled_function_that_writes_checks_its_bounds_or_says_why_they_hold() -> None:
    found = list(writing_functions())
    assert len(found) > 70
    silent = [
        place
        for place, own, module in found
        if "raise IndexError" not in own and not re.search(r"\bBounds\b", own + module)
    ]
    assert not silent


@pytest.fixture
def plan(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[Campaign]:
    """Campaigns that the command would run, and one test run that passes; nothing is run."""
    campaigns: list[Campaign] = []

    def run(campaign: Campaign, say: object) -> list[Report]:
        assert os.environ["NUMBA_BOUNDSCHECK"] == "1"
        assert os.environ["NUMBA_CACHE_DIR"] == str(tmp_path / "code")
        campaigns.append(campaign)
        return [Report(target.name, campaign.counts[target.name]) for target in campaign.targets]

    monkeypatch.setenv("FBA_BOUNDS_CACHE", str(tmp_path))
    monkeypatch.setattr(bounds, "run_campaign", run)
    monkeypatch.setattr(bounds, "_run_tests", lambda paths, jobs: 0)
    return campaigns


@needs_machine_code
def test_the_command_divides_inputs_among_all_targets(
    plan: list[Campaign], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("NUMBA_BOUNDSCHECK", raising=False)
    assert bounds.main(["--performances", "100", "--mutants", "1000", "--seed", "7"]) == 0
    (campaign,) = plan
    random = {target.name for target in targets() if target.random}
    assert sum(count for name, count in campaign.counts.items() if name in random) == 100
    assert sum(count for name, count in campaign.counts.items() if name not in random) == 1000
    assert {target.name for target in targets()} - set(campaign.counts) == {"stream-bounds"}
    assert campaign.seed == 7
    assert all(target.environment == {"NUMBA_BOUNDSCHECK": "1"} for target in campaign.targets)
    assert "NUMBA_BOUNDSCHECK" not in os.environ
    assert "ok      performances: 100 of 100, 0 findings" in capsys.readouterr().out


@needs_machine_code
@pytest.mark.parametrize("fault", ["finding", "unfinished", "tests"])
def test_the_command_fails_where_something_was_found(
    plan: list[Campaign], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, fault: str
) -> None:
    if fault == "tests":
        monkeypatch.setattr(bounds, "_run_tests", lambda paths, jobs: 2)
    else:
        finding = Finding("fap", 0, 3, "IndexError in loops.py:3", "index is out of bounds")
        report = Report("fap", 100 if fault == "finding" else 60, findings=[finding] * (fault == "finding"))
        monkeypatch.setattr(bounds, "run_campaign", lambda campaign, say: [report])
    assert bounds.main(["--performances", "0", "--mutants", "2700"]) == 1
    assert "FAILED" in capsys.readouterr().out


@needs_machine_code
def test_without_tests_only_inputs_run(plan: list[Campaign], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bounds, "_run_tests", lambda paths, jobs: pytest.fail("tests ran"))
    assert bounds.main(["--tests", "--performances", "3", "--mutants", "0"]) == 0
    assert [target.random for target in plan[0].targets] == [True] * 3
