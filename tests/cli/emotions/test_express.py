"""`fba express`: streams, pictures and tables of named expressions and mixtures.

`fba emotion`: what files with a face show.
"""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import fba
import graphics
from command_line import Run


def read_face(path: Path) -> fba.FaceTrack:
    face = fba.read(path).face
    assert face is not None
    return face


def test_two_of_the_six_are_sent_as_fap_2(run: Run, tmp_path: Path) -> None:
    done = run("express", "fear=60 joy=30", "-o", tmp_path / "a.fba", "--ease", "0")
    face = read_face(tmp_path / "a.fba")
    assert np.flatnonzero(face.mask.any(axis=0)).tolist() == [1]
    assert face.expression[40].tolist() == [4, 38, 1, 19, 0, 0]
    assert "FAP 2, " in done.out
    assert "--send faps" in done.out


def test_the_bits_are_those_of_the_file(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "a.fba"
    for way in ("expression", "faps"):
        report = json.loads(run("express", "fear=60", "joy=30", "-o", path, "--send", way, "--json").out)
        assert report["sent"] == way
        before_mark, end_code, _ = path.read_bytes().partition(b"\0\0\1\xb1")
        assert report["bits"][way] == 8 * len(before_mark + end_code)
    assert report["bits"]["expression"] < report["bits"]["faps"] / 3


def test_a_variant_is_sent_as_low_level_faps(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "a.fap"
    done = run("express", "terror=50", "-o", path, "--seconds", "2", "--ease", "0.4", "--fps", "10")
    assert "FAP 2 cannot say it" in done.out
    face = read_face(path)
    assert len(face) == 20
    full = fba.emotion.expression("terror").faps / 2
    assert np.abs(face.values[10] - full).max() <= 0.5
    assert not face.values[[0, -1]].any()
    moving = face.values[:, 18]
    assert (np.diff(np.abs(moving[:5])) > 0).all()
    run("express", "terror", "-o", path, "--send", "expression", code=2)


def test_sent_faps_show_the_mixture_on_any_face(tmp_path: Path, run: Run) -> None:
    """FAPs that are not sent copy no mate, though one-sided expressions move one side alone."""
    from fba.face import resolve

    for name in ("contempt", "sarcasm", "sneer", "crying"):
        run("express", name, "-o", tmp_path / "a.fba", "--ease", "0")
        shown = resolve(read_face(tmp_path / "a.fba"))[30]
        assert np.abs(shown - fba.emotion.expression(name).faps).max() <= 90  # a step of the head's angles


def test_a_point_of_the_plane(run: Run) -> None:
    done = run("express", "--at", "4.0,1.1", "--json")
    assert json.loads(done.out)["expressions"] == {"guilt": 100}
    assert run("express", "--at", "4.0,1.1").out.startswith("guilt=100: activation 4.0, evaluation 1.1")


def test_the_list_has_all_names(run: Run) -> None:
    listed = json.loads(run("express", "--list", "--json").out)
    assert [one["name"] for one in listed] == [one.name for one in fba.emotion.expressions()]
    text = run("express", "--list").out
    assert all(one["name"] in text for one in listed)


def test_the_rules_have_parameters(run: Run) -> None:
    for option in ("--interpolation", "--reduction", "--nearness"):
        run("express", "fear", option, "1.5", code=2)
    weak = json.loads(run("express", "fear=90 joy=60", "--reduction", "0", "--json").out)["faps"]
    strong = json.loads(run("express", "fear=90 joy=60", "--reduction", "1", "--json").out)["faps"]
    assert "lift_l_cheek" not in weak
    assert strong["lift_l_cheek"] == 228


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("", "give one of expressions (fear=60), --at A,E and --list"),
        ("fear --at 4,4", "give one of"),
        ("fer=5", "there is no expression 'fer' (did you mean 'fear'?)"),
        ("fear=101", "must be from 0 to 100, not 101"),
        ("fear=nan", "must be from 0 to 100, not nan"),
        ("fear=1 afraid=2", "'afraid' means 'fear', which is given already"),
        ("--at 4", "write e.g. 4.0,1.1"),
        ("--at 9,1", "the activation must be from 1 to 7"),
        ("fear --seconds 2", "--seconds goes with -o"),
        ("fear -o x.fba --size 30x30", "--size goes with a picture or a film"),
        ("fear -o x.fba --seconds 1 --ease 0.6", "easing in and out takes 1.2 s"),
        ("fear -o x.fba --seconds nan", "must be a number of at least 0"),
        ("fear -o x.fba --seconds 1e12", "are more than"),
        ("fear -o x.png --ease 1", "a picture shows the full expression"),
        ("--list -o x.fba", "--list prints a table"),
    ],
)
def test_mistakes(run: Run, line: str, message: str) -> None:
    done = run("express", *line.split(), code=2)
    assert done.out == ""
    assert message in " ".join(done.err.split())


def test_pictures_show_the_full_expression(run: Run, tmp_path: Path) -> None:
    if (reason := graphics.missing_opengl()) is not None:
        graphics.skip(reason)
    from PIL import Image

    for name in ("surprise", "anger"):
        path = tmp_path / f"{name}.png"
        run("express", name, "-o", path, "--size", "64x64")
    shown = [np.asarray(Image.open(tmp_path / f"{name}.png").convert("L")) for name in ("surprise", "anger")]
    assert shown[0].shape == (64, 64)
    assert np.abs(shown[0].astype(int) - shown[1]).max() > 40


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
    assert (middle["label"], middle["nearest"][0]["name"]) == ("anger", "rage")
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
