"""`fba play` without a file: a neutral figure to move by hand."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from command_line import Run
from fba import player
from fba.body import BodyModel
from fba.face import FaceModel


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, dict[str, Any]]]:
    """What windows were to show, and how."""
    found: list[tuple[Any, dict[str, Any]]] = []
    monkeypatch.setattr(player, "check_display", lambda: None)
    monkeypatch.setattr(player, "play", lambda build, **options: found.append((build(), options)))
    return found


def test_a_face_alone(run: Run, opened: list[tuple[Any, dict[str, Any]]], tmp_path: Path) -> None:
    FaceModel.default().save(tmp_path / "mine.glb")
    run("play", "--model", tmp_path / "mine.glb", "--size", "640x480")
    scene, options = opened[0]
    assert not scene.has_body
    assert not np.any(scene.timeline.faps(0.0))
    assert (options["panels"], options["paused"], options["size"]) == (("puppet",), True, (640, 480))
    assert options["title"] == "mine.glb"


def test_a_body_with_a_face(run: Run, opened: list[tuple[Any, dict[str, Any]]], tmp_path: Path) -> None:
    BodyModel.default().save(tmp_path / "body.glb")
    run("play", "--body", tmp_path / "body.glb", "--show", "grid")
    scene, _ = opened[0]
    assert scene.has_body
    assert scene.switches["grid"]
    assert scene.view_for(scene.timeline.faps(0.0), scene.timeline.baps(0.0)).faces


def test_without_anything_the_built_in_person(run: Run, opened: list[tuple[Any, dict[str, Any]]]) -> None:
    run("play")
    scene, options = opened[0]
    assert scene.has_body
    assert (options["panels"], options["title"]) == (("puppet",), "puppet")


def test_options_that_need_a_file(run: Run, opened: list[tuple[Any, dict[str, Any]]], tmp_path: Path) -> None:
    (tmp_path / "mine.glb").write_bytes(b"")
    for words, said in (
        (("--compare", "--model", tmp_path / "mine.glb"), "--compare needs two files"),
        (("--model", tmp_path / "mine.glb", "--audio", tmp_path / "mine.glb"), "--audio goes with a file"),
    ):
        assert said in run("play", *words, code=2).err
    assert not opened
