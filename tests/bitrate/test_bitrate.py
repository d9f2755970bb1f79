"""The study on a short sample: its rows, its files, its page; and what it says about bad input."""

import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

import fba
from bench.bitrate import (
    Result,
    make_page,
    make_pictures,
    measure,
    read_results,
    results_csv,
    split_subjects,
    summary_lines,
)
from bench.bitrate.__main__ import main
from bench.bitrate.points import UNPLANNED, Point, encode_live_at_rate, operating_points
from fba import Animation, EncoderOptions, FaceTrack
from fba.errors import FormatError, OptionError
from fba.planning import LiveEncoder

SAMPLES = files("fba") / "samples"


@pytest.fixture(scope="session")
def short_face() -> Animation:
    """Twelve frames of the sample that speaks."""
    return replace(fba.read(str(SAMPLES / "hello.fap"))[60:72], index=np.arange(12))


def few_points(kind: str) -> list[Point]:
    """Settings of each sort, of which each takes a while."""
    wanted = {
        "FBA compact, quantiser 1", "FBA compact, quantiser 31", "FBA exact, quantiser 1",
        "FBA, ranges known, quantiser 1", "FBA, nothing known, quantiser 1", "FBA, nothing known, 4 kbit/s",
        "FBA tolerance, 2 mm",
    }  # fmt: skip
    points = [one for one in operating_points(kind) if f"{one.method}, {one.setting}" in wanted]
    assert len(points) == len(wanted)
    return [*points, Point("FBA", "0.2 kbit/s", partial(encode_live_at_rate, rate=0.2))]


@pytest.fixture(scope="session")
def results(short_face: Animation) -> list[Result]:
    lines: list[str] = []
    found = measure("a test", split_subjects("short", short_face, "iso"), lines.append, few_points)
    assert lines[0] == "1 of 1: the face of short, 0.5 s"
    assert lines[1:] == ["FBA, 0.2 kbit/s: not possible for every face, so it is left out"]
    return found


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    def call(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as stop:
            main([str(one) for one in arguments])
        captured = capsys.readouterr()
        return int(stop.value.code or 0), captured.out, " ".join(captured.err.split())

    return call


def test_every_setting_has_a_row_and_the_others_have_one_for_its_values(results: list[Result]) -> None:
    own = {(one.method, one.point) for one in results if not one.numbers}
    assert own == {point[:2] for point in few_points("face")} - {("FBA", "0.2 kbit/s")}
    with_rivals = {"FBA compact, quantiser 1", "FBA tolerance, 2 mm"}
    for numbers in ("all", "sent"):
        deflate = [one for one in results if (one.method, one.numbers) == ("deflate, rows", numbers)]
        assert {one.point for one in deflate} == with_rivals
    assert {one.packets for one in results if "quantiser" in one.point} == {12}
    assert {one.seconds for one in results} == {0.48}


def test_rates_are_of_whole_streams_and_of_whole_packets(
    short_face: Animation, results: list[Result]
) -> None:
    encoder = LiveEncoder(EncoderOptions(mark=False))
    data = encoder.push_animation(short_face) + encoder.finish()
    (live,) = [one for one in results if (one.method, one.point) == (UNPLANNED, "quantiser 1")]
    assert live.file_bytes == len(data)
    assert live.file_rate == pytest.approx(len(data) * 8 / 480)
    assert live.live_bytes is not None
    bits = fba.probe(data).plane_bits
    assert 0 <= 8 * live.live_bytes - bits.sum() < 8 * 12
    assert live.header_rate == pytest.approx(8.0)  # 40 bytes, 25 times a second


def test_a_coarser_quantiser_is_smaller_and_further_off(results: list[Result]) -> None:
    compact = {one.point: one for one in results if one.method == "FBA compact"}
    fine, coarse = compact["quantiser 1"], compact["quantiser 31"]
    assert fine.live_bytes is not None
    assert coarse.live_bytes is not None
    assert coarse.live_bytes < fine.live_bytes
    assert 0 < fine.max_mm < 0.1 < coarse.max_mm
    assert fine.under == 1.0


def test_results_are_read_as_they_were_written(results: list[Result], tmp_path: Path) -> None:
    path = tmp_path / "results.csv"
    path.write_text(results_csv(results), encoding="utf-8")
    again = read_results(path)
    assert results_csv(again) == results_csv(results)
    assert [replace(one, max_mm=0, p99_mm=0, under=0, degrees=0) for one in again] == [
        replace(one, max_mm=0, p99_mm=0, under=0, degrees=0) for one in results
    ]
    path.write_text("a,b\n1,2\n", encoding="utf-8")
    with pytest.raises(FormatError, match=r"no results of `\./dev bitrate`"):
        read_results(path)
    path.write_text(results_csv(results).replace(",12,", ",twelve,", 1), encoding="utf-8")
    with pytest.raises(FormatError, match=r"results.csv:2: "):
        read_results(path)


def test_the_command_writes_page_pictures_and_numbers(
    results: list[Result], tmp_path: Path, run: Callable[..., tuple[int, str, str]]
) -> None:
    pytest.importorskip("matplotlib")
    path = tmp_path / "before.csv"
    path.write_text(results_csv(results), encoding="utf-8")
    code, out, _ = run("--results", path, "-o", tmp_path / "study", "--summary")
    assert code == 0
    assert out.splitlines() == summary_lines(read_results(path))
    made = {one.name: one.read_text(encoding="utf-8") for one in (tmp_path / "study").iterdir()}
    assert set(made) == {"results.csv", "bitrate.md", "a-test-faces.svg", "a-test-faces-bars.svg"}
    assert made["results.csv"] == path.read_text(encoding="utf-8")
    assert made["bitrate.md"] == make_page(read_results(path))
    assert (
        made["a-test-faces.svg"].encode() == make_pictures(read_results(path))["a-test-faces.svg"]
    )  # the same every time
    code, _, err = run("--results", path, "-o", tmp_path / "study", "--no-clobber")
    assert code == 1
    assert "results.csv" in err


def test_what_cannot_be_measured_is_said(
    tmp_path: Path, run: Callable[..., tuple[int, str, str]], short_face: Animation
) -> None:
    (tmp_path / "notes.txt").write_text("shopping list")
    code, out, err = run(tmp_path / "notes.txt")
    assert (code, out) == (1, "")
    assert "notes.txt" in err
    still = Animation(25, np.arange(3), FaceTrack.empty(3))
    fba.write(tmp_path / "still.fap", still)
    code, out, err = run(tmp_path / "still.fap")
    assert (code, out) == (1, "")
    assert "still.fap: nothing moves; left out" in err
    assert "there is no face and no body to measure" in err
    code, _, err = run(tmp_path / "still.fap", "--results", tmp_path / "notes.txt")
    assert code == 2
    assert "not both" in err
    (tmp_path / "taken").write_text("a file")
    code, _, err = run(SAMPLES / "hello.fap", "-o", tmp_path / "taken")
    assert code == 2
    with pytest.raises(OptionError, match="nothing moves"):
        measure("nothing", [])
    with pytest.raises(OptionError, match="short has no frames"):
        split_subjects("short", short_face[:0], "iso")


def test_without_its_packages_the_study_says_how_to_get_them(
    results: list[Result], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, short_face: Animation
) -> None:
    for name in ("matplotlib", "zstandard", "brotli"):
        monkeypatch.setitem(sys.modules, name, None)  # as if it were not installed
    with pytest.raises(OptionError, match=r"needs the package matplotlib.*\[bench\]"):
        make_pictures(results)
    from bench.bitrate.rivals import installed_rivals, missing_packages

    assert missing_packages() == ("zstandard", "brotli")
    assert {one.name.partition(",")[0] for one in installed_rivals()} == {
        "int16", "varints of differences", "deflate", "xz",
    }  # fmt: skip
