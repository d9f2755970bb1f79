"""The panel that opens and exports files."""

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

import fba
import graphics
from fba.animation import Animation
from fba_player.scene.scene import Scene
from fba_player.session import _exports
from fba_player.session._memory import Memory
from fba_player.session._session import Session

graphics.imported("imgui_bundle")

from fba_player._ui.panels._files_panel import FilesPanel  # noqa: E402
from studio_hand import StudioHand  # noqa: E402
from tools.window_picture import Studio  # noqa: E402


@pytest.fixture
def studio(talking: Animation, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Studio]:
    monkeypatch.chdir(tmp_path)
    session = Session(Scene(talking), size=(640, 720))
    session.open.add("files")
    with Studio(session) as one:
        one.settle(4)
        yield one


def panel_of(studio: Studio) -> FilesPanel:
    return next(panel for panel in studio.gui.panels if isinstance(panel, FilesPanel))


def finish(session: Session) -> None:
    begun = time.monotonic()
    while session.exports.now is not None:
        assert time.monotonic() - begun < 120
        time.sleep(0.05)
        session.exports.poll()


def test_a_stream_of_the_marked_part_is_exported(studio: Studio, tmp_path: Path) -> None:
    session, panel = studio.session, panel_of(studio)
    panel._exported = "part.fba"
    session.transport.mark_in, session.transport.mark_out = 0.08, 0.24
    studio.settle(2)
    StudioHand(studio).click(*panel.buttons["Export file"])
    assert session.exports.now is not None, session.notices()
    assert session.unsaved
    finish(session)
    said = [notice.text for notice in session.notices()]  # before they fade
    assert not session.unsaved
    assert said[0] == "Saved as part.fba"
    assert len(fba.read(tmp_path / "part.fba")) == 4
    StudioHand(studio).click(*panel.buttons["Export file"])  # it is not overwritten
    assert session.exports.now is None
    assert "exists already" in session.notices()[-1].text


def test_an_export_is_cancelled(studio: Studio, tmp_path: Path) -> None:
    session, panel = studio.session, panel_of(studio)
    panel._exported = "film.gif"
    studio.settle(1)
    StudioHand(studio).click(*panel.buttons["Export file"])
    studio.settle(2)
    StudioHand(studio).click(*panel.buttons["Cancel export"])
    assert session.exports.now.cancelled
    finish(session)
    assert session.notices()[-1].text == "The export was cancelled; no file is left"
    assert not session.rolling
    assert list(tmp_path.iterdir()) == []


def dialog_program(folder: Path, answer: str) -> None:
    """Write a program named as one that shows dialogs, which does what shell commands say."""
    program = folder / "bin" / "zenity"
    program.parent.mkdir()
    program.write_text(f"#!/bin/sh\n{answer}\n")
    program.chmod(0o755)


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have dialogs of their own")
@pytest.mark.parametrize(("field", "answered"), [("open", True), ("export", True), ("export", False)])
def test_the_answer_of_a_dialog_is_taken(
    studio: Studio, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, field: str, answered: bool
) -> None:
    dialog_program(tmp_path, "echo /elsewhere/talk.fba" if answered else "exit 1")
    monkeypatch.setenv("PATH", str(tmp_path / "bin"), prepend=":")
    panel = panel_of(studio)
    panel._exported = "mine.fba"
    monkeypatch.setattr(
        studio.session, "clock", lambda: 0.0
    )  # or its notice goes before a slow machine looks
    studio.settle(2)
    StudioHand(studio).click(*panel.buttons[f"browse {field}"])
    assert "dialog" in studio.session.rolling  # the window goes on while it is open
    begun = time.monotonic()
    while "dialog" in studio.session.rolling:
        assert time.monotonic() - begun < 120
        studio.settle(1)
    if field == "open":
        assert "/elsewhere/talk.fba" in studio.session.notices()[-1].text
    else:
        assert panel._exported == ("/elsewhere/talk.fba" if answered else "mine.fba")


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have dialogs of their own")
def test_a_window_that_closes_ends_its_dialog(
    studio: Studio, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    dialog_program(tmp_path, "exec sleep 1000")
    monkeypatch.setenv("PATH", str(tmp_path / "bin"), prepend=":")
    studio.settle(2)
    StudioHand(studio).click(*panel_of(studio).buttons["browse open"])
    studio.session.open.discard("files")
    begun = time.monotonic()
    studio.settle(2)
    assert time.monotonic() - begun < 500  # it did not wait for the program's end


def test_without_a_program_for_dialogs_it_says_so(studio: Studio, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_exports.sys, "platform", "linux")
    monkeypatch.setattr(_exports.shutil, "which", lambda name: None)
    assert not _exports.has_dialogs()
    monkeypatch.setattr(
        _exports.shutil, "which", lambda name: "/usr/bin/kdialog" if name == "kdialog" else None
    )
    assert _exports.has_dialogs()
    monkeypatch.setattr(_exports.sys, "platform", "win32")
    assert _exports.has_dialogs()


def test_a_file_that_was_shown_before_is_opened_from_the_list(
    studio: Studio, talking: Animation, tmp_path: Path
) -> None:
    session, panel = studio.session, panel_of(studio)
    assert "Recent..." not in panel.buttons  # nothing is remembered here
    fba.write(tmp_path / "other.fba", talking)
    session.memory = Memory(tmp_path / "settings")
    session.memory.add("other.fba")
    studio.settle(2)
    hand = StudioHand(studio)
    hand.click(*panel.buttons["Recent..."])
    studio.settle(2)
    hand.click(*panel.recent["other.fba"])
    assert session.dropped == (tmp_path / "other.fba",)
    assert session.closing
