"""F2: the panel about the file."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from fba.codec import PartInfo, StreamInfo
from fba_player._ui import theme
from fba_player._ui.panels.panel import Panel, facts, heading, wrapped
from fba_player.playback._timeline import clock_text
from fba_player.scene.compare import CompareScene
from fba_player.session._session import Session


class FilePanel(Panel):
    """Name, format, frames, rate, bits, planes, masks and warnings."""

    name, title, label = "file", "Contents of the file", "Info"
    side = "left"
    width, height, fitted, least = 330.0, 430.0, True, 170.0

    def __init__(self) -> None:
        self._shown: tuple[StreamInfo, list[tuple[str, list[tuple[str, str]]]]] | None = None

    def draw(self, session: Session) -> None:
        source, info = session.source, session.source.info
        if self._shown is None or self._shown[0] is not info:
            self._shown = (info, _sections(session, info))
        for title, rows in self._shown[1]:
            if title:
                heading(title, exact=title[0].isdigit())
            facts(title or "file", rows)
        troubles = [*source.warnings, *(str(lost.error) for lost in info.damage)]
        if troubles:
            heading("Warnings")
            for text in troubles[:20]:
                wrapped(text, theme.WARM)
            if len(troubles) > 20:
                wrapped(f"and {len(troubles) - 20} more", theme.WARM)


def _sections(session: Session, info: StreamInfo) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return (heading, rows) of each section of the panel."""
    if isinstance(session.scene, CompareScene):
        return _sections_of_several(session.scene)
    parts = [("", _about_file(session, info))]
    if info.plane_bits is not None:
        parts.append(("Stream", _stream(info)))
    for title, name, part in (("Face", "FAPs", info.face), ("Body", "BAPs", info.body)):
        if part is not None:
            parts.append((title, _part(part, name, info.frames)))
    return parts


def _sections_of_several(scene: Any) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return (heading, rows) of each of several animations that are compared."""
    parts = []
    for number, (name, shown) in enumerate(zip(scene.names, scene.scenes, strict=True)):
        times, animation = shown.timeline, shown.animation
        rows = [("frames", f"{times.frames}"), ("rate", f"{float(times.rate):g} frames/s")]
        rows.append(("duration", clock_text(times.duration)))
        if times.start:
            rows.append(("starts at", clock_text(times.start)))
        for title, track in (("FAPs", animation.face), ("BAPs", animation.body)):
            if track is not None:
                sent = tuple((np.flatnonzero(track.mask.any(axis=0)) + 1).tolist())
                rows.append((title, f"{len(sent)}: {_ranges(sent)}" if sent else "none"))
        parts.append((f"{number + 1}  {name}", rows))
    return parts


def _about_file(session: Session, info: StreamInfo) -> list[tuple[str, str]]:
    rows = [("name", session.source.name or "untitled")]
    if session.source.path is not None:
        folder = os.path.dirname(os.path.abspath(session.source.path))
        rows += [("folder", folder)] if folder != os.getcwd() else []
        rows += [("kind", info.format.upper()), ("size", _bytes(info.size))]
    rows.append(("frames", f"{info.frames}" + (f", {info.skipped} skipped" if info.skipped else "")))
    rows.append(("rate", f"{float(info.rate):g} frames/s"))
    rows.append(("duration", clock_text(info.duration)))
    if info.start:
        rows.append(("starts at", clock_text(info.start)))
    return rows


def _stream(info: StreamInfo) -> list[tuple[str, str]]:
    assert info.plane_bits is not None
    assert info.plane_intra is not None
    bits, intra = info.plane_bits, info.plane_intra
    rows = [("bit rate", f"{info.bits_per_second / 1000:.2f} kbit/s")]
    for kind, chosen in (("I planes", intra), ("P planes", ~intra)):
        count = int(chosen.sum())
        rows.append((kind, f"{count}, on average {bits[chosen].mean():.0f} bits" if count else "none"))
    rows.append(("largest", f"{int(bits.max())} bits"))
    if info.start_codes:
        rows.append(("start codes", f"{info.start_codes}"))
    return rows


def _part(part: PartInfo, name: str, frames: int) -> list[tuple[str, str]]:
    rows = [(name, f"{len(part.parameters)}: {_ranges(part.parameters)}")]
    if part.frames != frames:
        rows.append(("frames", f"{part.frames} of {frames}"))
    if part.quants:
        rows.append(("quantiser", ", ".join(str(quant) for quant in part.quants)))
    if part.mask_types:
        rows.append(("masks", ", ".join(part.mask_types)))
    return rows


def _ranges(numbers: tuple[int, ...]) -> str:
    """Return the ascending numbers with runs shortened: "3..42, 48"."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][1] + 1:
            runs[-1][1] = number
        else:
            runs.append([number, number])
    return ", ".join(f"{a}" if a == b else f"{a}..{b}" for a, b in runs)


def _bytes(size: int) -> str:
    if size < 10_000:
        return f"{size} bytes"
    return f"{size / 1000:.1f} kB" if size < 1_000_000 else f"{size / 1e6:.1f} MB"
