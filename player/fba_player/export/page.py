"""Animations as one self-contained page that any browser plays, from disk and without a network."""

from __future__ import annotations

import base64
import gzip
import hashlib
import html
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

from fba.animation import Animation
from fba.atomic import PathLike
from fba.body import BodyModel
from fba.carriage.mp4 import write_sound
from fba.errors import FormatError
from fba.face import FaceModel
from fba.parameters import BapTable
from fba_player.sound.coded_sound import read_coded_sound
from fba_player.web import pack_body, pack_face

SOUND_TYPES = {
    ".wav": "audio/wav", ".mp3": "audio/mpeg", ".m4a": "audio/mp4", ".aac": "audio/aac", ".ogg": "audio/ogg",
    ".opus": "audio/ogg", ".oga": "audio/ogg", ".flac": "audio/flac", ".webm": "audio/webm",
}  # fmt: skip
"""Media types of sounds that browsers play, by suffix."""
FILMS = (".mp4", ".m4v", ".mov")
"""Suffixes of files of which the sound alone goes into a page."""
MOST_SOUND_BYTES = 64_000_000
"""Largest sound that goes into a page."""
BUNDLE = "dist/fba-player.min.js"
"""The player in JavaScript, in the package `fba_player.web`."""
BUILT_IN = {False: "dist/head.fbam", True: "dist/person.fbam"}
"""The built-in head and person, which tools/web/make_figures.py packs."""
VIEWS = ("front", "three-quarter", "profile", "body")

_PAGE = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<title>{title}</title>
<link rel="icon" href="data:,">
<style>
html, body {{ margin: 0; height: 100%; background: #45484c; font: 14px system-ui, sans-serif; }}
fba-player {{ position: fixed; inset: 0; border-radius: 0; }}
p {{ position: fixed; z-index: 1; inset: 0 0 auto; margin: 0; padding: 1rem; background: #fff; }}
</style>
<body>
<noscript><p>This page plays an animation, for which it needs JavaScript.</p></noscript>
<fba-player controls></fba-player>
<script type="application/json" id="fba-content">{content}</script>
<script type="module">{script}</script>
</body>
</html>
"""


@dataclass(frozen=True)
class PageStream:
    """A stream in a page. name: shown to the reader. data: its bytes. bap_steps: its table of BAP steps, if
    it has a body and names none itself."""

    name: str
    data: bytes
    bap_steps: BapTable | None = None


def make_page(
    streams: Sequence[PageStream],
    *,
    model: FaceModel | None = None,
    body: BodyModel | None = None,
    with_body: bool = False,
    with_head: bool = True,
    live: bool = False,
    audio: PathLike | None = None,
    audio_offset: float = 0.0,
    title: str = "",
    view: str = "",
    loop: bool = False,
) -> str:
    """Return a page, as HTML, that plays streams side by side.

    model, body: the figure, by default the built-in ones. with_body, with_head: whether it holds a person for
    streams with a body, and a head for those without. live: whether it shows a stream of the server that it
    comes from (`fba.serving`) instead of its own. audio: a sound file that begins audio_offset seconds after
    the first frame; it goes into the page as it is. title: of the page, by default the names of the streams.
    view: one of `VIEWS`, by default what suits the content. loop: whether to begin again at the end.

    Raises FormatError for a sound that browsers do not play, or that is too large.
    """
    content: dict[str, Any] = {
        "title": title or " | ".join(stream.name for stream in streams) or "FBA",
        "sources": [_source(stream) for stream in streams],
        "figures": [
            _encoded(pack_figure(model, body if person else None, with_body=person))
            for person in (True, False)
            if (with_body if person else with_head)
        ],
        "live": live,
        "view": view,
        "loop": loop,
    }
    if audio is not None:
        content |= {"audio": _sound(Path(audio)), "audioOffset": audio_offset}
    script = (files("fba_player.web") / BUNDLE).read_text(encoding="utf-8").replace("</script", "<\\/script")
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = (
        f"default-src 'none'; script-src 'sha256-{digest}'; style-src 'unsafe-inline'; img-src data: blob:; "
        "media-src data: blob:; connect-src 'self' data: blob:; base-uri 'none'; form-action 'none'"
    )
    text = json.dumps(content, ensure_ascii=True).replace("<", "\\u003c")
    return _PAGE.format(policy=policy, title=html.escape(content["title"]), content=text, script=script)


def pack_figure(
    model: FaceModel | None = None, body: BodyModel | None = None, *, with_body: bool = False
) -> bytes:
    """Return the file of a figure that pages and `<fba-player model="...">` show.

    model, body: by default the built-in ones. with_body: whether a body without a model is the built-in one,
    not left out.
    """
    person = with_body or body is not None
    if model is None and body is None:
        return (files("fba_player.web") / BUILT_IN[person]).read_bytes()
    packed = (
        pack_body(body or BodyModel.default(), model) if person else pack_face(model or FaceModel.default())
    )
    return gzip.compress(packed, 9, mtime=0)


def animation_page(animation: Animation, **options: Any) -> str:
    """Return a page that plays an animation. options: as for `make_page`."""
    from fba.codec import encode_animation

    started = replace(animation, index=animation.index - animation.index[0])  # a page begins at 0
    stream = PageStream(animation.name or "animation", encode_animation(started)[0])
    with_body = animation.body is not None
    return make_page([stream], with_body=with_body, with_head=not with_body, **options)


def _source(stream: PageStream) -> dict[str, str]:
    given = {"name": stream.name, "data": _encoded(stream.data)}
    return given if stream.bap_steps is None else {**given, "bapSteps": stream.bap_steps}


def _encoded(data: bytes) -> str:
    return base64.b64encode(data).decode()


def _check_size(path: Path, size: int) -> None:
    """Raise FormatError for a sound of too many bytes."""
    if size > MOST_SOUND_BYTES:
        raise FormatError(
            f"has {size:,} bytes of sound, more than the {MOST_SOUND_BYTES:,} that a page may hold; "
            "convert it to MP3 or Opus, or cut it",
            path=path,
        )


def _sound(path: Path) -> str:
    """Return the data URI of a sound."""
    media = SOUND_TYPES.get(path.suffix.lower())
    if path.suffix.lower() in FILMS:
        data = write_sound(read_coded_sound(path))
        _check_size(path, len(data))
        return f"data:audio/mp4;base64,{_encoded(data)}"
    if media is None:
        known = ", ".join(SOUND_TYPES)
        raise FormatError(f"is no sound that browsers play; expected one of {known}", path=path)
    try:
        _check_size(path, path.stat().st_size)
        return f"data:{media};base64,{_encoded(path.read_bytes())}"
    except OSError as error:
        raise FormatError(f"cannot be read: {error.strerror}", path=path) from error
