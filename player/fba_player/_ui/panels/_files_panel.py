"""F8: opens files, and exports what is shown to films, pictures, streams and other files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from imgui_bundle import imgui

from fba_player._ui import theme
from fba_player._ui.panels.panel import Panel, choose_name, heading, tooltip, wrapped
from fba_player.export._background import ExportOptions
from fba_player.playback.live import LiveAnimation
from fba_player.session._exports import NO_DIALOGS, has_dialogs
from fba_player.session._session import Session

KINDS = {
    ".mp4": "film", ".gif": "GIF film", ".png": "picture", ".fba": "FBA stream", ".glb": "glTF",
    ".bvh": "BVH", ".fap": "FAP text", ".bap": "BAP text",
}  # fmt: skip
"""What can be exported, by suffix."""
FACE_KINDS, BODY_KINDS = (".fap",), (".bvh", ".bap")
"""Suffixes of files that hold a face or a body alone."""
SIZES = ("as the window", "640 x 360", "1280 x 720", "1920 x 1080", "3840 x 2160")
HERE = os.path.join(os.curdir, "")
"""Where a dialog begins: dialogs of Linux would else show the files that other programs used last."""
BROWSE_WIDTH = 86.0
"""Points beside a name for its button."""


class FilesPanel(Panel):
    """The name of a file to open; and name, kind, size and part of an export, and how far it is."""

    name, title, label = "files", "Open and export", "File"
    width, height, fitted, least = 340.0, 330.0, True, 200.0

    def __init__(self) -> None:
        self._opened = ""
        self._exported = ""
        self._kind = 0
        self._size = 2
        self._marked = True
        self._replaced = ""  # a name that the system's dialog has asked about
        self._dialog: tuple[str, Any] | None = None
        self.buttons: dict[str, tuple[float, float]] = {}
        """Centres of buttons by name, in points; for tests."""
        self.recent: dict[str, tuple[float, float]] = {}
        """Centres of recent files by name."""

    def draw(self, session: Session) -> None:
        """Draw the content."""
        self._take_answer(session)
        heading("Open")
        self._opened, entered = self._name("open", self._opened, "name of a file")
        if (self._button("Open file") or entered) and self._opened:
            session.drop((Path(self._opened).expanduser(),))
        tooltip("show another file in the window")
        self._draw_recent(session)
        heading("Export")
        animation: Any = getattr(session.scene, "animation", None)
        if isinstance(animation, LiveAnimation):
            wrapped("A stream that arrives is recorded with Ctrl+R.", theme.FAINT)
            return
        suffixes = [suffix for suffix in KINDS if _holds(animation, suffix)]
        self._kind = choose_name(
            "as##kind", [f"{KINDS[suffix]} ({suffix})" for suffix in suffixes],
            min(self._kind, len(suffixes) - 1), -86,
        )  # fmt: skip
        suffix = suffixes[self._kind]
        if suffix in (".mp4", ".gif", ".png"):
            self._size = choose_name("size", SIZES, self._size, -86)
        transport = session.transport
        marked = transport.mark_in is not None or transport.mark_out is not None
        if marked and suffix != ".png":
            _, self._marked = imgui.checkbox("between the marks", self._marked)
        proposed = session.source.stem + suffix
        self._exported, entered = self._name("export", self._exported, proposed)
        if session.exports.now is None:
            if self._button("Export file") or entered:
                path = Path(self._exported or proposed).expanduser()
                path = path if path.suffix else path.with_suffix(suffix)
                part = marked and self._marked
                options = self._options(session, part=part, suffix=path.suffix.lower())
                session.exports.begin(path, options, replace=self._exported == self._replaced != "")
        else:
            export = session.exports.now
            if self._button("Cancel export"):
                session.exports.cancel()
            imgui.same_line()
            text = f"{export.done} of {export.total}" if export.total else "preparing"
            imgui.progress_bar(export.share, (-1, 0), "stopping" if export.cancelled else text)
        if not has_dialogs():
            wrapped(NO_DIALOGS, theme.FAINT)

    def _draw_recent(self, session: Session) -> None:
        """Draw a list of the files that were shown before; a click opens one."""
        source = session.source.path
        shown = None if source is None else Path(source).absolute()
        recent = [
            path for path in (session.memory.recent if session.memory is not None else ()) if path != shown
        ]
        if not recent:
            return
        imgui.same_line()
        if self._button("Recent..."):
            imgui.open_popup("recent")
        tooltip("files that were shown before")
        if not imgui.begin_popup("recent"):
            return
        for number, path in enumerate(recent):
            if imgui.selectable(f"{path.name}##{number}", False)[0]:
                session.drop((path,))
            self.recent[path.name] = _centre()
            tooltip(str(path))
        imgui.end_popup()

    def _options(self, session: Session, *, part: bool, suffix: str) -> ExportOptions:
        """Return the options of the export as they are chosen now."""
        transport, viewpoint = session.transport, session.viewpoint
        wide, high = session.size
        if self._size:
            wide, high = (int(word) for word in SIZES[self._size].split(" x "))
        if suffix == ".mp4":
            wide, high = wide // 2 * 2, high // 2 * 2
        return ExportOptions(
            size=(wide, high),
            camera=viewpoint.camera_for_export(wide / high),
            time=transport.time,
            start=transport.mark_in if part else None,
            end=transport.mark_out if part else None,
            audio=session.sound,
            audio_offset=session.sound_offset,
            follow=viewpoint.following,
            bap_steps=session.source.bap_steps,
        )

    def _name(self, what: str, text: str, hint: str) -> tuple[str, bool]:
        """Draw a field for a name, and a button for a dialog; return the name, and whether Enter ended it."""
        browses = has_dialogs()
        imgui.set_next_item_width(-BROWSE_WIDTH if browses else -1)
        entered, text = imgui.input_text_with_hint(
            f"##{what}", hint, text, imgui.InputTextFlags_.enter_returns_true
        )
        if browses:
            imgui.same_line()
            if self._button(f"Browse###browse {what}"):
                self._ask(what, hint)
        return text, bool(entered)

    def _ask(self, what: str, hint: str) -> None:
        """Show the dialog of the system; the window goes on meanwhile."""
        from imgui_bundle import portable_file_dialogs as dialogs

        if self._dialog is None:
            asked = (
                dialogs.open_file("Open", HERE) if what == "open" else dialogs.save_file("Export as", hint)
            )
            self._dialog = (what, asked)

    def _take_answer(self, session: Session) -> None:
        if self._dialog is None:
            session.rolling.discard("dialog")
            return
        session.rolling.add("dialog")
        what, asked = self._dialog
        if not asked.ready(0):
            return
        self._dialog = None
        answer = asked.result()
        if what == "export":
            self._exported = self._replaced = answer or self._exported
        elif answer:
            self._opened = answer[0]
            session.drop((Path(answer[0]),))

    def closed(self, session: Session) -> None:
        """End a dialog that is open: forgetting one alone waits until the user has closed it."""
        if self._dialog is not None:
            self._dialog[1].kill()
        self._dialog = None
        session.rolling.discard("dialog")

    def _button(self, text: str) -> bool:
        pressed = imgui.button(text)
        self.buttons[text.rpartition("###")[2]] = _centre()
        return bool(pressed)


def _centre() -> tuple[float, float]:
    """Return the centre of the last item, in points."""
    low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
    return (low.x + high.x) / 2, (low.y + high.y) / 2


def _holds(animation: Any, suffix: str) -> bool:
    """Return whether a kind of file can hold something of an animation."""
    if suffix in FACE_KINDS:
        return getattr(animation, "face", None) is not None
    return suffix not in BODY_KINDS or getattr(animation, "body", None) is not None
