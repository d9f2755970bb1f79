"""`fba emotion`: what files with a face show."""

import csv
import json
from pathlib import Path

import pytest

import fba
from command_line import Run


@pytest.fixture
def angry(tmp_path: Path) -> Path:
    path = tmp_path / "angry.fap"
    blend = fba.emotion.combine({"rage": 80})
    fba.write(path, fba.emotion.animate(blend, seconds=2, ease=0.6))
    return path


def test_a_summary_and_the_changes(run: Run, angry: Path) -> None:
    done = run("emotion", angry)
    lines = done.out.splitlines()
    assert "50 frames; anger" in lines[0]
    assert [line.split()[1] for line in lines[2:-1]] == ["neutral", "anger", "neutral"]
    assert "say nothing" in lines[-1]
    assert len(run("emotion", angry, "--frames").out.splitlines()) == 50 + 3


def test_json_and_csv_say_the_same(run: Run, angry: Path, tmp_path: Path) -> None:
    report = json.loads(run("emotion", angry, "--json").out)
    assert report["main"] == "anger"
    middle = report["frames"][25]
    assert middle["label"] == "anger"
    assert middle["nearest"][0]["name"] == "rage"
    assert 60 <= middle["nearest"][0]["intensity"] <= 100
    assert 4 < middle["activation"] < 4.5
    run("emotion", angry, "-o", tmp_path / "out.csv")
    rows = list(csv.DictReader((tmp_path / "out.csv").read_text(encoding="utf-8").splitlines()))
    assert [row["label"] for row in rows] == [one["label"] for one in report["frames"]]
    assert rows[25]["nearest"].startswith("rage=")


def test_the_stream_of_an_expression_is_read_as_that_expression(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "a.fba"
    for name in ("joy", "surprise=70", "contempt"):
        run("express", name, "-o", path)
        main = json.loads(run("emotion", path, "--json").out)["main"]
        assert main == fba.emotion.expression(name.partition("=")[0]).family


def test_a_file_without_a_face(run: Run, body: fba.Animation, tmp_path: Path) -> None:
    fba.write(tmp_path / "body.bap", body)
    done = run("emotion", tmp_path / "body.bap", code=1)
    assert done.out == ""
    assert "has no face: it sends no FAPs" in done.err


def test_options_that_contradict(run: Run, angry: Path) -> None:
    run("emotion", angry, "-o", "-", "--json", code=2)
    run("emotion", angry, "--baseline", "mean", code=2)
