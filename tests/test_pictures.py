"""The pictures of the documentation: one command makes each of them, and each is shown somewhere."""

import re
import sys
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """What `docs/make_pictures.py` makes: functions by the names of files."""
    monkeypatch.syspath_prepend(str(DOCS))
    pictures: dict[str, str] = import_module("make_pictures").PICTURES
    return pictures


def test_one_command_makes_every_picture_that_is_shown(made: dict[str, str]) -> None:
    shown = set()
    for page in (ROOT / "README.md", *DOCS.glob("*.md")):
        folder = "docs/images/" if page.name == "README.md" else "images/"
        shown |= set(re.findall(rf"\]\({folder}([^)]+)\)", page.read_text(encoding="utf-8")))
    assert shown == set(made)
    assert {path.name for path in (DOCS / "images").iterdir()} == set(made)


def test_every_picture_has_its_function(made: dict[str, str]) -> None:
    for name, function in made.items():
        module, _, what = function.rpartition(".")
        if module in ("pictures.loss_picture", "make_bitrate_page"):
            pytest.importorskip("matplotlib", reason="plots need matplotlib")
        assert callable(getattr(import_module(module), what)), name


def test_only_the_named_picture_is_made(
    made: dict[str, str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    script = import_module("make_pictures")
    monkeypatch.setattr(script, "IMAGES", tmp_path)
    written = []
    monkeypatch.setattr(script, "make", lambda function, names: written.append(names))
    monkeypatch.setattr(sys, "argv", ["make_pictures.py", "angry", "hello.png"])
    assert script.main() == 0
    assert written == [["angry.jpg"], ["hello.png"]]
    monkeypatch.setattr(sys, "argv", ["make_pictures.py", "angri"])
    with pytest.raises(SystemExit):
        script.main()
    assert "there is no picture 'angri' (did you mean 'angry'?)" in capsys.readouterr().err


def test_what_cannot_be_made_is_said(
    made: dict[str, str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    script = import_module("make_pictures")

    def fails(function: str, names: list[str]) -> None:
        raise FileNotFoundError("no recording")

    monkeypatch.setattr(script, "make", fails)
    monkeypatch.setattr(sys, "argv", ["make_pictures.py", "dance"])
    assert script.main() == 1
    assert "dance.jpg: not made: no recording" in capsys.readouterr().err
