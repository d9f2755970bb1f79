"""`fba model`: what it prints and writes, and how it fails.

`fba model points`: what is said before and after the window, which other tests open.
"""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from command_line import Run
from fba.body import BodyModel
from fba.cli.model_text import error_lines, judge_import
from fba.cli.printing import table_lines
from fba.face import FaceModel, checks, feature_point_names
from fba.face.checks import Finding
from fba.face.importers.head_surface import HeadSurface
from fba_player.export.contact_sheet import TILE
from fba_player.scene._point_placement import PointPlacement
from fba_player.window import pages
from mesh_files import write_obj
from small_head import small_head

TEETH = ("9.8", "9.9", "9.10", "9.11")
"""Teeth stay rigid: a head of another width does not stretch them."""


@pytest.fixture
def person(tmp_path: Path) -> Path:
    """The built-in head's own points, a tenth wider, in centimetres, as an FDP file."""
    points = FaceModel.default().points * (110.0, 100.0, 100.0)
    lines = ["1.0 person.fdp 0 0 0 0 0 0"]
    lines += [
        f"  {name} {x:.7f} {y:.7f} {z:.7f}"
        for name, (x, y, z) in zip(feature_point_names(), points, strict=True)
    ]
    path = tmp_path / "person.fdp"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_info_tells_parts_units_and_points(run: Run) -> None:
    _, out, err = run("model", "info", "--default")
    assert err == ""
    head = FaceModel.default()
    assert f"{len(head.vertices)} vertices" in out
    for part in head.parts:
        assert part.name in out
    pupils = head.points[feature_point_names().index("3.5")] - head.points[feature_point_names().index("3.6")]
    assert f"{pupils[0] * 1000:.1f} mm" in out
    assert "84 of 84" in out


def test_info_as_json(run: Run) -> None:
    out = run("model", "info", "--default", "--json").out
    told = json.loads(out)
    head = FaceModel.default()
    assert told["vertices"] == len(head.vertices)
    assert [part["name"] for part in told["parts"]] == [part.name for part in head.parts]
    assert told["feature_points"]["9.3"] == pytest.approx(
        head.points[feature_point_names().index("9.3")], abs=1e-6
    )
    assert told["fapu"]["AU"] == 1e-5
    assert told["faps"] == list(range(3, 69))


def test_info_needs_one_model(run: Run, tmp_path: Path) -> None:
    for arguments in ([], ["--default", str(tmp_path)]):
        _, out, err = run("model", "info", *arguments, code=2)
        assert out == ""
        assert "--default" in err


def test_no_subcommand_shows_all(run: Run) -> None:
    code, out, err = run("model", code=None)
    for name in ("info", "validate", "import", "points", "fit"):
        assert name in out + err
    assert code in (0, 2)


@pytest.mark.parametrize("name", ["info", "validate", "import", "points", "fit"])
def test_help_shows_examples_and_debug(run: Run, name: str) -> None:
    out = run("model", name, "--help").out
    assert f"fba model {name}" in out.split("Examples:")[1]
    assert "--debug" in out


def test_fit_writes_a_model_of_the_person(run: Run, person: Path, tmp_path: Path) -> None:
    target = tmp_path / "person.glb"
    _, out, err = run("model", "fit", person, "-o", target, "--tables", "carry")
    assert err == ""
    assert out.startswith(f"{target}: ")
    fitted, head = FaceModel.load(target), FaceModel.default()
    soft = [row for row, name in enumerate(feature_point_names()) if name not in TEETH]
    np.testing.assert_allclose(fitted.points[soft], head.points[soft] * (1.1, 1, 1), atol=2e-6)
    assert fitted.name == "person"
    assert "in cm" in fitted.notes["fitted"]


def test_fit_takes_csv_and_a_unit(run: Run, tmp_path: Path) -> None:
    points = FaceModel.default().points
    rows = [
        f"{name},{x},{y},{z}" for name, (x, y, z) in zip(feature_point_names(), points / 0.0254, strict=True)
    ]
    path = tmp_path / "person.csv"
    path.write_text("point,x,y,z\n" + "\n".join(rows) + "\n")
    target = tmp_path / "head.glb"
    run("model", "fit", path, "-o", target, "--unit", "in", "--tables", "carry", "--name", "Ada")
    fitted = FaceModel.load(target)
    assert fitted.name == "Ada"
    np.testing.assert_allclose(fitted.points, points, atol=2e-6)


def test_fit_fails_in_one_line_and_writes_nothing(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "spot.fdp"
    path.write_text("1.0 spot\n" + "".join(f"{name} 1 2 3\n" for name in feature_point_names()))
    target = tmp_path / "head.glb"
    _, out, err = run("model", "fit", path, "-o", target, code=1)
    assert out == ""
    assert err.count("\n") == 1
    assert "coincide" in err
    assert not target.exists()


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--unit", "parsec"], "parsec"),
        (["--tables", "guess"], "guess"),
        (["--model", "/no/such/head.glb"], "/no/such/head.glb"),
    ],
)
def test_fit_bad_usage(run: Run, person: Path, tmp_path: Path, arguments: list[str], text: str) -> None:
    _, out, err = run("model", "fit", person, "-o", tmp_path / "head.glb", *arguments, code=2)
    assert out == ""
    assert text in err


def test_fit_of_distances_alone(run: Run, shared: Path, tmp_path: Path) -> None:
    """alice.fdp names vertices of a mesh that is not there, but gives distances in mm."""
    target = tmp_path / "alice.glb"
    err = run("model", "fit", shared / "data/xface/alice.fdp", "-o", target, "--tables", "carry").err
    assert "only the distances" in err
    fapu = FaceModel.load(target).fapu
    mm = {"ES": 69, "ENS": 51, "MNS": 30, "MW": 50, "IRISD": 16}
    assert {unit: fapu[unit] * 1024 * 1000 for unit in mm} == pytest.approx(mm, abs=0.002)


def test_import_of_a_mesh(run: Run, shared: Path, tmp_path: Path) -> None:
    target = tmp_path / "head.glb"
    assert run("model", "import", shared / "models/makehuman", "-o", target).out.startswith(f"{target}: ")
    assert {part.kind for part in FaceModel.load(target).parts} >= {"skin", "eye", "teeth", "tongue"}


@pytest.mark.usefixtures("opengl")
def test_import_ends_with_a_verdict_and_a_sheet(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    small_head().with_tables((), dict.fromkeys(range(3, 69), "left out")).save(tmp_path / "head.glb")
    monkeypatch.setitem(TILE, "review", (24, 24))  # big ones take long
    arguments = ("model", "import", str(tmp_path / "head.glb"), "-o", str(tmp_path / "out.glb"))
    _, out, err = run(*arguments, "--sheet", str(tmp_path / "sheet.png"))
    assert "good: it meets the standard (0 errors" in out + err
    with Image.open(tmp_path / "sheet.png") as picture:
        assert picture.width > 8 * 24
        assert len(set(picture.convert("L").resize((64, 64)).tobytes())) > 50
    assert "--sheet" in run(*arguments, "--sheet", str(tmp_path / "sheet.txt"), code=2).err


def test_a_poor_head_is_said_in_one_line_and_written(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bad = Finding("FAP 3 open_jaw", "rule", "1 mm", "2 mm")
    monkeypatch.setattr(checks, "check_faps", lambda model: [bad] * 11)
    small_head().save(tmp_path / "head.glb")
    err = run("model", "import", tmp_path / "head.glb", "-o", tmp_path / "out.glb").err
    (line,) = [line for line in err.splitlines() if "poor" in line]
    assert line.startswith(
        f"fba: poor: {tmp_path / 'out.glb'}: streams will look wrong on this face (11 errors"
    )
    assert FaceModel.load(tmp_path / "out.glb").points.shape == (84, 3)


def test_verdicts_by_the_number_of_errors() -> None:
    bad, odd = Finding("FAP 3", "rule", "1 mm", "2 mm"), Finding("FAP 3", "rule", "1", "2", "warning")
    assert [judge_import(some)[0] for some in ([odd] * 30, [bad] * 10, [bad] * 11)] == [
        "good",
        "fair",
        "poor",
    ]
    assert error_lines([odd, bad]) == ["error    FAP 3: rule: 1 mm, not 2 mm"]
    assert error_lines([bad] * 20)[-1].endswith("and 12 more")


def test_import_of_something_else(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "note.txt"
    path.write_text("hello\n")
    _, out, err = run("model", "import", path, "-o", tmp_path / "head.glb", code=1)
    assert out == ""
    assert err.count("\n") == 1
    assert "note.txt" in err


@pytest.mark.parametrize("kind", ["eyes", "eye", "=eye", "left=ear"])
def test_import_part_needs_a_name_and_a_kind(run: Run, person: Path, tmp_path: Path, kind: str) -> None:
    _, out, err = run("model", "import", person, "-o", tmp_path / "head.glb", "--part", kind, code=2)
    assert out == ""
    assert "NAME=KIND" in err


def test_validate_passes_and_fails(run: Run, tmp_path: Path) -> None:
    """A head whose lower lip hangs 8 mm open is no neutral face."""
    from dataclasses import replace

    run("model", "validate", "--default", "--only", "neutral")
    head = FaceModel.default()
    skin = head.part("skin")
    lower = [feature_point_names().index(name) for name in ("2.3", "2.8", "2.9")]
    vertices, points = np.array(skin.vertices), np.array(head.points)
    vertices[head.bound[lower] - head.starts["skin"]] -= (0, 0.008, 0)
    points[lower] -= (0, 0.008, 0)
    parts = tuple(replace(skin, vertices=vertices) if part is skin else part for part in head.parts)
    path = tmp_path / "open.glb"
    replace(head, parts=parts, points=points).save(path)
    out = run("model", "validate", path, "--only", "neutral", code=1).out
    assert "8.0 mm apart" in out
    assert f"{path}: 3 errors" in out
    out = run("model", "validate", path, "--only", "neutral", "--json", code=1).out
    told = json.loads(out)
    assert told["errors"] == 3
    assert sum(finding["rule"] == "lips touch" for finding in told["findings"]) == 3


def test_validate_checks_every_fap(run: Run) -> None:
    _, out, err = run("model", "validate", "--default", "--json")
    assert err == ""
    told = json.loads(out)
    assert told["errors"] == 0, told["findings"]


def test_tables_are_folded_to_the_width_of_a_terminal() -> None:
    head, rows = ("file", "bytes"), [("a_long_name_of_a_file.fba", "12"), ("b.fba", "3456")]
    assert table_lines(head, rows, to_right=(1,)) == [
        "file                       bytes",
        "a_long_name_of_a_file.fba     12",
        "b.fba                       3456",
    ]
    assert table_lines(head, rows, to_right=(1,), width=20) == [
        "file           bytes",
        "a_long_name_o     12",
        "f_a_file.fba",
        "b.fba           3456",
    ]
    assert max(map(len, table_lines(("name", "text"), [("x", "words " * 40)], width=30))) <= 30


def test_simplify_writes_a_smaller_face_and_tells_how_good_it_is(run: Run, tmp_path: Path) -> None:
    small_head().save(tmp_path / "head.glb")
    target = tmp_path / "small.glb"
    _, out, err = run("model", "simplify", tmp_path / "head.glb", "-o", target, "--ratio", 0.3, "--json")
    assert err == ""
    told = json.loads(out)
    small = FaceModel.load(target)
    assert len(small.triangles) == told["levels"][0]["faces"] == round(0.3 * told["faces"])
    assert 0 < told["levels"][0]["error_mm"] < 20
    out = run("model", "simplify", tmp_path / "head.glb", "-o", target, "--error", "2mm").out
    assert f"{len(FaceModel.load(target).triangles)} triangles" in out
    err = run(
        "model", "simplify", tmp_path / "head.glb", "-o", target, "--faces", 100, "--no-clobber", code=1
    ).err
    assert "exists" in err


def test_simplify_tells_of_a_goal_that_is_out_of_reach(run: Run, tmp_path: Path) -> None:
    head = small_head()
    skin = head.parts[0]
    doubled = replace(skin, triangles=np.concatenate([skin.triangles, skin.triangles]))
    replace(head, parts=(doubled, *head.parts[1:])).save(tmp_path / "doubled.glb")
    _, out, err = run("model", "simplify", tmp_path / "doubled.glb", "-o", tmp_path / "a.glb", "--faces", 500)
    assert "asked for 500 triangles, but no edge is left that may collapse" in err
    assert "3884 triangles and 66 errors before" in out


def test_simplify_takes_a_body_too(run: Run, tmp_path: Path) -> None:
    target = tmp_path / "small.glb"
    out = run("model", "simplify", "--default", "--body", "-o", target, "--ratio", 0.25, "--json").out
    (row,) = json.loads(out)["levels"]
    small = BodyModel.load(target)
    assert row == {"faces": len(small.triangles), "vertices": len(small.vertices)}
    assert row["faces"] <= round(0.25 * len(BodyModel.default().triangles))


def test_simplify_stores_levels_with_the_model(run: Run, tmp_path: Path) -> None:
    head = small_head(cell=0.004)
    head.save(tmp_path / "head.glb")
    target = tmp_path / "levels.glb"
    out = run("model", "simplify", tmp_path / "head.glb", "-o", target, "--levels", 2).out
    model = FaceModel.load(target)
    assert len(model.triangles) == len(head.triangles)
    sizes = [len(level.model.triangles) for level in model.levels]
    assert len(sizes) == 2
    assert sizes[0] > sizes[1]
    assert all(f"{size} triangles" in out for size in sizes)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--default"], "how far to simplify is missing"),
        (["--default", "--faces", 9, "--ratio", 0.5], "--faces and --ratio contradict each other"),
        (["--faces", 900], "give either the MODEL to simplify"),
        (["--default", "--body", "--levels", 2], "--body goes with --faces or --ratio"),
        (["--default", "--ratio", 0], "0"),
        (["--default", "--faces", 0], "0"),
        (["--default", "--ratio", "nan"], "'nan' is not a number"),
        (["--default", "--levels", 17], "17"),
        (["--default", "--faces", 3], "3 triangles are too few"),
    ],
)
def test_simplify_refuses_what_contradicts_itself(
    run: Run, tmp_path: Path, arguments: list[object], message: str
) -> None:
    code, out, err = run("model", "simplify", *arguments, "-o", tmp_path / "out.glb", code=None)
    assert code in (1, 2)
    assert out == ""
    assert message in " ".join(err.split())
    assert not (tmp_path / "out.glb").exists()


@pytest.fixture
def head(tmp_path: Path) -> Path:
    write_obj(tmp_path / "head.obj", small_head().parts)
    return tmp_path / "head.obj"


@pytest.fixture
def user(monkeypatch: pytest.MonkeyPatch) -> list[Callable[[PointPlacement], None]]:
    """What is done in the window, in place of a user."""
    doings: list[Callable[[PointPlacement], None]] = []

    def show(surface: HeadSurface, path: Path, **options: Any) -> PointPlacement:
        placement = PointPlacement(surface, path)
        for do in doings:
            do(placement)
        return placement

    monkeypatch.setattr(pages, "check_page", lambda subject: None)
    monkeypatch.setattr(pages, "place_points", show)
    return doings


def test_saved_points_are_reported_with_the_next_command(
    run: Run, head: Path, user: list[Callable[[PointPlacement], None]], tmp_path: Path
) -> None:
    points = tmp_path / "head.points.csv"
    user.append(lambda placement: placement.save())
    _, out, err = run("model", "points", head, "-o", points)
    assert err == ""
    assert "no face can be made without 3.1, 3.3, 3.2, 3.4, 9.15, 2.2, 8.3, 8.4" in out
    user.insert(0, lambda placement: placement.places.update(dict.fromkeys(placement.missing_units, 5)))
    _, out, err = run("model", "points", head, "--points", points, "-o", points, "--kind", "obj")
    assert err == ""
    assert f"next: fba model import {head} --points {points} --kind obj -o head.fba.glb" in out


def test_parts_that_are_left_out_are_not_shown(
    run: Run, head: Path, user: list[Callable[[PointPlacement], None]], tmp_path: Path
) -> None:
    points, shown = tmp_path / "p.csv", []
    user.append(lambda placement: shown.extend(part.name for part in placement.surface.parts))
    user.append(lambda placement: placement.places.update(dict.fromkeys(placement.missing_units, 5)))
    user.append(lambda placement: placement.save())
    out = run("model", "points", head, "-o", points, "--part", "left eye=none").out
    assert "skin" in shown
    assert "left eye" not in shown
    assert "--part 'left eye=none'" in out
    err = run("model", "points", head, "-o", points, "--part", "left eye=nose", code=2).err
    assert "write NAME=KIND" in err


def test_closing_without_saving_fails(
    run: Run, head: Path, user: list[Callable[[PointPlacement], None]], tmp_path: Path
) -> None:
    out = run("model", "points", head, "-o", tmp_path / "p.csv", code=1).out
    assert "not written, as the window was closed without saving" in out
    assert not (tmp_path / "p.csv").exists()


def test_without_a_display_it_says_how_to_write_the_file(
    run: Run, head: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DISPLAY", ":990")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    code, _, err = run("model", "points", head, "-o", tmp_path / "p.csv", code=None)
    assert code != 0
    assert "'name,vertex'" in err
    assert "fba render" not in err


@pytest.mark.parametrize(("output", "words"), [("-", "give the name of a file"), ("p.json", "name it p.csv")])
def test_points_are_written_as_csv(run: Run, head: Path, output: str, words: str) -> None:
    assert words in run("model", "points", head, "-o", output, code=2).err


def test_the_head_is_not_overwritten(run: Run, head: Path) -> None:
    before = head.read_bytes()
    run("model", "points", head, "-o", head, code=2)
    assert head.read_bytes() == before
