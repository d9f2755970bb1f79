"""What windows remember, and that a damaged memory is no harm."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fba_player.session._memory import MOST_BYTES, MOST_RECENT, NAME, Memory


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
