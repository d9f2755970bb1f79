"""The page of bit rates and the README's table show the numbers in bench/results, which fit each other."""

import importlib.util
from pathlib import Path

import pytest

from bench.bitrate import Result, read_results, results_csv, summary_lines
from bench.bitrate.choices import compare, group_results
from bench.bitrate.points import operating_points

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "bench" / "results"
TABLES = ("recordings-faces.csv", "recordings-bodies.csv", "samples.csv")


@pytest.fixture(scope="module")
def results() -> dict[str, list[Result]]:
    return {name: read_results(RESULTS / name) for name in TABLES}


def test_the_page_is_made_of_the_results() -> None:
    script = ROOT / "docs" / "make_bitrate_page.py"
    spec = importlib.util.spec_from_file_location("make_bitrate_page", script)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    shown = (ROOT / "docs" / "bitrate.md").read_text(encoding="utf-8")
    assert module.make_page() == shown, "run: python docs/make_bitrate_page.py"


def test_the_readme_shows_the_summary_as_it_is_printed(results: dict[str, list[Result]]) -> None:
    lines = summary_lines([one for name in TABLES for one in results[name]])
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert "\n".join(lines) + "\n" in readme, "run: ./dev bitrate --summary --results ..., as README.md says"
    assert len(lines) > 6


@pytest.mark.parametrize("name", TABLES)
def test_results_hold_every_setting(results: dict[str, list[Result]], name: str) -> None:
    groups = group_results(results[name])
    assert {group[0].kind for group in groups} == (
        {"face", "body"} if name == "samples.csv" else {"face" if "faces" in name else "body"}
    )
    for group in groups:
        own = {(one.method, one.point) for one in group if not one.numbers}
        points = {point[:2] for point in operating_points(group[0].kind)}
        assert own <= points
        assert all("kbit/s" in point for _, point in points - own)  # rates too low for some file
        assert compare(group)


@pytest.mark.parametrize("name", TABLES)
def test_sums_are_those_of_the_single_files(results: dict[str, list[Result]], name: str) -> None:
    for group in group_results(results[name]):
        for total in (one for one in group if one.subject == "all" and not one.numbers):
            parts = [one for one in group if (one.method, one.point) == (total.method, total.point)]
            single = [one for one in parts if one.subject != "all"]
            if total.subjects > 1:
                assert len(single) == total.subjects
            assert sum(one.file_bytes or 0 for one in single) == total.file_bytes
            assert sum(one.frames for one in single) == total.frames
            assert max(one.max_mm for one in single) == total.max_mm


def test_rates_in_the_files_are_those_of_their_bytes() -> None:
    for name in TABLES:
        text = (RESULTS / name).read_text(encoding="utf-8")
        assert results_csv(read_results(RESULTS / name)) == text
        first = dict(zip(text.splitlines()[0].split(","), text.splitlines()[1].split(","), strict=True))
        rate = int(first["file_bytes"]) * 8 / 1000 / float(first["seconds"])
        assert float(first["file_kbit_s"]) == pytest.approx(rate, abs=6e-4)
