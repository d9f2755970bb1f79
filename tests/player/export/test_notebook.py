"""What a notebook shows of an animation, without a notebook."""

import base64
import io
import json
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import fba
from fba.animation import Animation
from fba.errors import DisplayError
from fba.player import Preview
from fba_player.export import _offscreen as offscreen
from fba_player.export import notebook
from fba_player.export.page import animation_page
from player_tracks import face_track
from sound_clicks import click_time, write_click

av = pytest.importorskip("av")


class Page(HTMLParser):
    """The elements of a page with their attributes, and its text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: dict[str, dict[str, str | None]] = {}
        self.open: list[str] = []
        self.text = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements[tag] = dict(attrs)
        if tag not in ("img", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data

    def data(self, tag: str, kind: str) -> bytes:
        source = self.elements[tag]["src"] or ""
        assert source.startswith(f"data:{kind};base64,")
        return base64.b64decode(source.partition(",")[2], validate=True)


class Shell:
    """As much of IPython's InteractiveShell as showing a value takes."""

    def __init__(self) -> None:
        self.display_formatter = self
        self.formatters = {"text/html": self}
        self._functions: dict[tuple[str, str], Callable[[Any], str]] = {}

    def for_type_by_name(self, module: str, name: str, function: Callable[[Any], str]) -> None:
        self._functions[module, name] = function

    def html(self, value: object) -> str:
        """What a cell shows that ends in this value."""
        kind = type(value)
        return self._functions[kind.__module__, kind.__qualname__](value)


def shown(subject: Animation | Preview) -> Page:
    if isinstance(subject, Preview):
        text = subject._repr_html_()
    else:
        shell = Shell()
        notebook.show_animations(shell)
        text = shell.html(subject)
    page = Page(text)
    assert page.open == []
    return page


def test_a_clip_shows_itself_as_a_page_to_play(talking: Animation) -> None:
    page = shown(talking[6:])
    assert page.text == "talking: 4 frames, 0:00.160 at 25 frames/s, face"
    framed = page.elements["iframe"]["srcdoc"] or ""
    assert framed == animation_page(talking[6:])
    sandbox = (page.elements["iframe"]["sandbox"] or "").split()
    assert "allow-same-origin" not in sandbox
    assert "allow-top-navigation" not in sandbox
    content = re.search(r'id="fba-content">(.*?)</script>', framed)
    [source] = json.loads(content[1])["sources"]
    assert len(fba.decode(base64.b64decode(source["data"]))) == 4


@pytest.mark.usefixtures("opengl")
def test_where_frames_are_left_out_there_is_a_picture(talking: Animation) -> None:
    pixels = np.asarray(Image.open(io.BytesIO(shown(talking).data("img", "image/jpeg"))))
    assert pixels.shape == (notebook.PAGE_HEIGHT - notebook.BAR_HEIGHT, notebook.PAGE_WIDTH, 3)
    assert pixels.std() > 10


def test_without_opengl_there_is_the_page_alone(talking: Animation, monkeypatch: pytest.MonkeyPatch) -> None:
    def none() -> None:
        raise DisplayError("no OpenGL")

    monkeypatch.setattr(offscreen, "offscreen_context", none)
    elements = shown(talking).elements
    assert "iframe" in elements
    assert "img" not in elements


def test_what_no_stream_carries_shows_itself_as_a_film(talking: Animation) -> None:
    loud = replace(talking, face=replace(talking.face, values=np.where(talking.face.mask, 2**30, 0)))
    assert "A film only:" in shown(loud).text


@pytest.mark.usefixtures("opengl")
def test_a_preview_is_a_small_film(talking: Animation) -> None:
    page = shown(Preview(talking[6:]))
    assert page.text == "talking: 4 frames, 0:00.160 at 25 frames/s, face"
    assert page.elements["video"]["width"] == "480"
    with av.open(io.BytesIO(page.data("video", "video/mp4"))) as film:
        frames = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
    assert (len(frames), frames[0].shape) == (4, (360, 480, 3))
    assert np.abs(frames[0].astype(int) - frames[3]).max() > 40  # the mouth opens


@pytest.mark.usefixtures("opengl")
def test_long_clips_are_cut_and_fast_clips_thinned(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notebook, "MAX_FILM_SECONDS", 0.05)
    long = Animation(120, np.array([0, 9000]), face=face_track([{3: 1}, {3: 900}]))
    preview = Preview(long, width=48, start=2.0)
    page = shown(preview)
    assert "Shown are 0.05 s from 0:02.000 on" in page.text
    assert "player.render(clip" in page.text
    with av.open(io.BytesIO(page.data("video", "video/mp4"))) as film:
        assert film.streams.video[0].average_rate == 30
        assert len(list(film.decode(video=0))) == 2
    assert preview._repr_html_() is preview._repr_html_()  # made once


@pytest.mark.usefixtures("opengl")
def test_large_films_stay_out_of_the_page(talking: Animation, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notebook, "MAX_FILM_BYTES", 1000)
    page = shown(Preview(talking, width=64))
    assert "would add 0.0 MB to the page" in page.text
    assert Image.open(io.BytesIO(page.data("img", "image/png"))).size == (64, 48)


@pytest.mark.usefixtures("opengl")
def test_without_an_encoder_it_is_a_picture(talking: Animation, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    page = shown(Preview(talking, width=64))
    assert "A still picture only" in page.text
    assert '"mpeg4-fba[films]"' in page.text
    pixels = np.asarray(Image.open(io.BytesIO(page.data("img", "image/png"))))
    assert pixels.shape == (48, 64, 3)
    assert pixels.std() > 10


def test_without_opengl_it_is_a_line(talking: Animation, monkeypatch: pytest.MonkeyPatch) -> None:
    def none() -> None:
        raise DisplayError("no OpenGL: install libegl1 & libgl1")

    monkeypatch.setattr(offscreen, "offscreen_context", none)
    page = shown(Preview(talking))
    assert "No picture: no OpenGL: install libegl1 & libgl1" in page.text
    assert not {"video", "img"} & page.elements.keys()


def test_an_empty_clip_is_a_line_and_names_are_only_text(talking: Animation) -> None:
    page = shown(replace(talking[:0], name="<b>a</b> & 'b'"))
    assert page.text == "<b>a</b> & 'b': 0 frames, 0:00.000 at 25 frames/s, face"
    assert "b" not in page.elements


def test_ranges_outside_the_animation_and_bad_sizes_are_refused(talking: Animation) -> None:
    assert "start 7 s is outside the animation" in shown(Preview(talking, start=7.0)).text
    with pytest.raises(ValueError, match="16 pixels"):
        Preview(talking, width=8)
    with pytest.raises(ValueError, match="finite"):
        Preview(talking, end=float("inf"))
    assert repr(Preview(talking)) == "<preview of talking: 10 frames, 0:00.400 at 25 frames/s, face>"


def test_importing_fba_does_not_import_the_player() -> None:
    ours = "{'fba.player', 'fba_player', 'av', 'PIL', 'moderngl'}"
    code = f"import sys, fba; fba.Animation; print({ours} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"


@pytest.mark.parametrize("where", ["notebook", "script"])
def test_importing_the_player_in_a_notebook_makes_it_show_animations(tmp_path: Path, where: str) -> None:
    (tmp_path / "IPython.py").write_text(
        """
class Shell:
    def for_type_by_name(self, module, name, function):
        print(module, name)

shell = Shell()
shell.display_formatter, shell.formatters = shell, {"text/html": shell}

def get_ipython():
    import sys
    return shell if sys.argv[1] == "notebook" else None
"""
    )
    code = "import IPython, sys, fba.player; print('numpy' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code, where], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines()[:-1] == ["fba.animation Animation"] * (where == "notebook")
    assert done.stdout.splitlines()[-1] == str(where == "notebook")


def test_a_preview_has_the_sound_that_is_given(opengl: None, talking: Animation, tmp_path: Path) -> None:
    wav = write_click(tmp_path / "talk.wav", 0.1)
    text = Preview(talking, width=32, audio=wav)._repr_html_()
    assert " muted" not in text
    path = tmp_path / "shown.mp4"
    path.write_bytes(base64.b64decode(text.partition("base64,")[2].partition('"')[0]))
    assert click_time(path) == pytest.approx(0.1, abs=0.006)
    with av.open(str(path)) as film:
        assert film.streams.video


def test_in_a_terminal_it_is_one_line(talking: Animation, walking: Animation) -> None:
    assert repr(talking) == "<Animation talking: 10 frames at 25 frames/s, 0.4 s, face>"
    assert repr(walking) == "<Animation walking: 10 frames at 25 frames/s, 0.4 s, face, body>"
