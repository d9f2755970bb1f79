"""`fba model points`: what is said before and after the window, which other tests open."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from command_line import Run
from fba.face.importers.head_surface import HeadSurface
from fba_player.scene._point_placement import PointPlacement
from fba_player.window import pages
from mesh_files import write_obj
from small_head import small_head


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
