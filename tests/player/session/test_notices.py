"""What a session says, for how long, and what it takes to close it over unsaved work.

What windows remember, and that a damaged memory is no harm.
"""

import json
from pathlib import Path

import pytest

from fba.animation import Animation
from fba.player import Scene
from fba_player.session._memory import MOST_BYTES, MOST_RECENT, NAME, Memory
from fba_player.session._session import Session
from set_clock import Clock


@pytest.fixture
def session(talking: Animation) -> Session:
    return Session(Scene(talking), clock=Clock())


def later(session: Session, seconds: float) -> None:
    assert isinstance(session.clock, Clock)
    session.clock.now += seconds


def test_closing_again_within_six_seconds_discards(session: Session) -> None:
    """Time to read the warning; after that, somebody may have forgotten it."""
    session.unsaved = {"the take"}
    session.leave()
    assert not session.closing
    later(session, 6.1)
    session.leave()
    assert not session.closing
    assert [notice.text for notice in session.notices()] == ["Unsaved: the take. Close again to discard"]
    later(session, 5.9)
    session.leave()
    assert session.closing


def test_the_warning_goes_once_the_work_is_saved(session: Session) -> None:
    session.unsaved = {"the take"}
    session.leave()
    session.unsaved.clear()
    assert not session.notices()


def test_without_unsaved_work_it_closes_at_once(session: Session) -> None:
    session.leave()
    assert session.closing


def test_a_notice_stays_four_seconds_and_fades_in_the_last_half(session: Session) -> None:
    assert not session.restless
    session.say("Saved")
    later(session, 3.4)
    assert not session.restless
    later(session, 0.2)  # it fades: new pictures are needed
    assert session.restless
    assert len(session.notices()) == 1
    later(session, 0.5)
    assert session.notices() == []
    assert not session.restless


def test_the_mouse_cursor_hides_after_three_idle_seconds_of_playing(session: Session) -> None:
    session.touched()
    later(session, 3.1)
    assert not session.hides_mouse
    session.transport.play()
    session.touched()
    later(session, 2.9)
    assert not session.hides_mouse
    later(session, 0.2)
    assert session.hides_mouse
    session.touched()
    assert not session.hides_mouse


def test_files_are_remembered_the_newest_first(tmp_path: Path) -> None:
    folder = tmp_path / "not" / "there"
    for number in (*range(12), 8):
        Memory(folder).add(tmp_path / f"{number}.fba")
    recent = Memory(folder).recent
    assert len(recent) == MOST_RECENT
    assert [path.stem for path in recent[:3]] == ["8", "11", "10"]
    assert len(set(recent)) == MOST_RECENT


def test_names_become_absolute(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Memory(tmp_path).add("here.fba")
    assert Memory(tmp_path).recent == [tmp_path / "here.fba"]


def test_two_windows_do_not_forget_what_the_other_has_written(tmp_path: Path) -> None:
    one, other = Memory(tmp_path), Memory(tmp_path)
    one.add(tmp_path / "a.fba")
    other.welcome()
    assert Memory(tmp_path).recent == [tmp_path / "a.fba"]
    assert Memory(tmp_path).welcomed


@pytest.mark.parametrize(
    "content",
    ["", "[]", "{", '{"recent": "x", "welcomed": "yes"}', '{"recent": [1, null, {}]}', "[" * 60_000, "\x00"],
    ids=["empty", "list", "cut", "wrong", "numbers", "deep", "zero"],
)
def test_a_damaged_file_counts_as_empty_and_is_replaced(tmp_path: Path, content: str) -> None:
    (tmp_path / NAME).write_text(content, encoding="utf-8")
    memory = Memory(tmp_path)
    assert (memory.recent, memory.welcomed) == ([], False)
    memory.welcome()
    assert json.loads((tmp_path / NAME).read_text(encoding="utf-8"))["welcomed"] is True


def test_a_large_file_is_not_read(tmp_path: Path) -> None:
    (tmp_path / NAME).write_text(json.dumps({"welcomed": True, "more": " " * MOST_BYTES}), encoding="utf-8")
    assert not Memory(tmp_path).welcomed


def test_without_a_place_to_write_it_remembers_for_this_window(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder", encoding="utf-8")
    memory = Memory(tmp_path / "file")
    memory.welcome()
    assert memory.welcomed
    assert not Memory(tmp_path / "file").welcomed


def test_the_folder_can_be_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FBA_CONFIG", str(tmp_path / "settings"))
    Memory().welcome()
    assert (tmp_path / "settings" / NAME).is_file()
