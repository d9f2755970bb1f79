"""F6: the panel of the bit rate over time, the bits of each plane, and totals of I and P planes."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Any

import numpy as np
from imgui_bundle import imgui

from fba.animation import Animation
from fba.arrays import Bool, Float64
from fba.codec import StreamInfo, probe_stream
from fba.compiled import is_compiled
from fba.errors import FbaError
from fba_player._ui import theme
from fba_player._ui.panels._curve_data import Course
from fba_player._ui.panels._curve_plot import CURVE_HEIGHT, LABEL_HEIGHT, Lane, Lanes
from fba_player._ui.panels.panel import Panel, tooltip
from fba_player._ui.ruler import Ruler
from fba_player.playback._time_zoom import TimeZoom
from fba_player.playback._timeline import clock_text
from fba_player.scene.compare import CompareScene
from fba_player.scene.scene import Scene
from fba_player.session._session import Session

AVERAGED_SECONDS = 1.0
"""Seconds over which the bit rate is averaged."""
MAX_VALUES = 3_000_000 if is_compiled() else 30_000
"""Most values of an animation that is encoded only to show its bit rate: about a second."""
BARS_HEIGHT = 34.0
"""Height of the bars in points."""
MIN_LISTED_SHARE = 0.02
"""Least share of bits around the planes that is listed."""
MIN_TABLE_WIDTH = 340.0
"""Least width in points for all columns of the table; a narrower one has one less."""
MIN_BAR_WIDTH = 3.0
"""Least width in points of a bar with its gap."""


@dataclass(frozen=True)
class Total:
    """Sum over one kind of planes. planes: number, None for bits outside of planes. share: of all bits."""

    name: str
    planes: int | None
    bits: int
    share: float


@dataclass(frozen=True, eq=False)
class Rates:
    """Bits of a stream over time.

    times: seconds of the planes (T,). bits, intra (T,): size and kind of each. rate: kbit/s (N,) in the
    second that ends with each of the last N planes; for those before, less than a second is known. totals: of
    I planes, P planes and the bits around them. mean: kbit/s.
    """

    times: Float64
    bits: Float64
    intra: Bool
    rate: Float64
    totals: tuple[Total, ...]
    mean: float


def measure_rates(info: StreamInfo) -> Rates | None:
    """Return the bit rates of a stream; None if it has no planes."""
    if info.plane_bits is None or info.plane_intra is None or info.frame_index is None or not info.frames:
        return None
    times = (info.frame_index - info.frame_index[0]) / float(info.rate) + float(info.start)
    bits, intra = info.plane_bits.astype(np.float64), info.plane_intra
    until = np.r_[0.0, np.cumsum(bits)]
    before = np.searchsorted(times, times - AVERAGED_SECONDS + 1e-9, side="left")
    rate = (until[1:] - until[before]) / AVERAGED_SECONDS / 1000
    full_second = times[0] + AVERAGED_SECONDS - 1 / float(info.rate)
    first = min(int(np.searchsorted(times, full_second - 1e-9)), len(times) - 1)
    all_bits = max(8 * info.size, int(bits.sum()), 1)
    rows = [
        Total(name, int(kind.sum()), int(bits[kind].sum()), float(bits[kind].sum()) / all_bits)
        for name, kind in (("I planes", intra), ("P planes", ~intra))
    ]
    rest = 8 * info.size - int(bits.sum())
    if rest > 0:
        rows.append(Total("around them", None, rest, rest / all_bits))
    return Rates(times, bits, intra, rate[first:], tuple(rows), info.bits_per_second / 1000)


def probe_encoded(animation: Animation) -> StreamInfo | None:
    """Return information about an animation as if encoded; None if it is too long or cannot be encoded."""
    tracks = [track for track in (animation.face, animation.body) if track is not None]
    if not len(animation) or sum(int(track.mask.sum()) for track in tracks) > MAX_VALUES:
        return None
    from fba.planning import encode

    try:
        return probe_stream(encode(animation))
    except (FbaError, ValueError):
        return None


def bars_of_planes(
    times: Float64, bits: Float64, intra: Bool, low: float, high: float, count: int
) -> tuple[Float64, Bool]:
    """Return the bits (count,) of the largest plane in each equal part of low..high, 0 without one.

    Also whether the part has an I plane.
    """
    tall, key = np.zeros(count), np.zeros(count, bool)
    if not high > low:
        return tall, key
    seen = (times >= low - 1e-9) & (times <= high + 1e-9)
    columns = np.clip(((times[seen] - low) / (high - low) * count).astype(int), 0, count - 1)
    np.maximum.at(tall, columns, bits[seen])
    key[columns[intra[seen]]] = True
    return tall, key


class RatePanel(Panel):
    """kbit/s in the last second, a bar for each plane, and a table.

    An animation that is no stream is encoded to measure it.
    """

    name, title, label = "rate", "Bit rate", "Bit rate"
    side = "left"
    width, height, least = 430.0, 238.0, 230.0

    def __init__(self) -> None:
        self._rates: tuple[StreamInfo, Rates | None, list[Lane]] | None = None
        self._bars: tuple[tuple[object, ...], list[tuple[float, float, float, bool]]] = ((), [])
        self._encoded: tuple[Any, list[StreamInfo | None]] | None = None
        self.time_zoom = TimeZoom()
        self.lanes = Lanes()
        self.bars = (0.0, 0.0, 0.0, 0.0)
        """Left, top, right, bottom of the bars in points; for tests."""

    def available(self, session: Session) -> bool:
        return not isinstance(session.scene, CompareScene)

    def draw(self, session: Session) -> None:
        info, note = self._stream(session)
        if info is None:
            imgui.text_colored(theme.FAINT, note)
            return
        if self._rates is None or self._rates[0] is not info:
            rates = measure_rates(info)
            self._rates = (info, rates, _lanes(rates, note) if rates is not None else [])
        _, rates, lanes = self._rates
        if rates is None:
            imgui.text_colored(theme.FAINT, "There are no planes.")
            return
        transport = session.transport
        self.time_zoom = session.zoom
        high = BARS_HEIGHT + 6 + imgui.get_text_line_height_with_spacing() * 2.5
        imgui.begin_child(
            "rate", (0, max(imgui.get_content_region_avail().y - high, LABEL_HEIGHT + CURVE_HEIGHT + 24))
        )
        row = _row(rates, transport.time) - (len(rates.times) - len(rates.rate))
        now = {("rate", 0): float(rates.rate[row])} if row >= 0 else {}
        self.lanes.draw(session, lanes, self.time_zoom, now)
        imgui.end_child()
        self._planes(session, rates)
        _table(rates)

    def closed(self, session: Session) -> None:
        session.rolling.discard(self.name)

    def _stream(self, session: Session) -> tuple[StreamInfo | None, str]:
        """Return (stream to measure, note about it); without a stream, the note is the text to show."""
        info = session.source.info
        if info.plane_bits is not None:
            return info, ""
        if session.source.probing:
            return None, "Reading..."
        animation = session.scene.animation if isinstance(session.scene, Scene) else None
        if not isinstance(animation, Animation):
            return None, "There are no planes."
        if self._encoded is None or self._encoded[0] is not animation:
            result: list[StreamInfo | None] = []
            self._encoded = (animation, result)
            threading.Thread(
                target=lambda: result.append(probe_encoded(animation)), name="fba rate", daemon=True
            ).start()
        if not self._encoded[1]:
            session.rolling.add(self.name)
            return None, "Encoding, to measure its bit rate..."
        session.rolling.discard(self.name)
        encoded = self._encoded[1][0]
        return encoded, "if encoded" if encoded else "It cannot be encoded, or is too long."

    def _planes(self, session: Session, rates: Rates) -> None:
        """Draw the bars; a click seeks."""
        left, top = imgui.get_cursor_screen_pos()
        wide = max(imgui.get_content_region_avail().x, 8.0)
        imgui.invisible_button("planes", (wide, BARS_HEIGHT))
        ruler = Ruler(self.time_zoom.low, self.time_zoom.high, left, left + wide)
        self.bars = (left, top, left + wide, top + BARS_HEIGHT)
        mouse = imgui.get_io().mouse_pos.x
        if imgui.is_item_active():
            session.touched()
            session.transport.seek(ruler.time(mouse))
        elif imgui.is_item_hovered():
            row = _row(rates, ruler.time(mouse))
            kind = "I" if rates.intra[row] else "P"
            imgui.set_tooltip(f"{clock_text(rates.times[row])}   {kind} plane, {rates.bits[row]:.0f} bits")
        to = imgui.get_window_draw_list()
        to.add_rect_filled(
            (left, top), (left + wide, top + BARS_HEIGHT), theme.packed(theme.HOLLOW), rounding=3.0
        )
        plain, key = theme.packed(theme.ACCENT, 0.75), theme.packed(theme.WARM)
        for x, right, tall, intra in self._bar_boxes(rates, wide):
            corners = (left + x, top + BARS_HEIGHT - tall), (left + right, top + BARS_HEIGHT)
            to.add_rect_filled(*corners, key if intra else plain)
        at = ruler.x(session.transport.time)
        if self.time_zoom.low <= session.transport.time <= self.time_zoom.high:
            to.add_line((at, top), (at, top + BARS_HEIGHT), theme.packed(theme.TEXT, 0.8))

    def _bar_boxes(self, rates: Rates, wide: float) -> list[tuple[float, float, float, bool]]:
        """Return (left, right, height, I plane) of the bars; cached until something changes."""
        time_zoom = self.time_zoom
        made_for = (rates, time_zoom.low, time_zoom.high, wide)
        if self._bars[0] == made_for:
            return self._bars[1]
        inside = int(((rates.times >= time_zoom.low) & (rates.times <= time_zoom.high)).sum())
        count = max(min(int(wide / MIN_BAR_WIDTH), inside), 1)
        tall, intra = bars_of_planes(
            rates.times, rates.bits, rates.intra, time_zoom.low, time_zoom.high, count
        )
        heights = np.where(
            tall > 0, 2 + (BARS_HEIGHT - 6) * np.sqrt(tall / max(float(rates.bits.max()), 1.0)), 0.0
        )
        each = wide / count
        gap = 1 if each >= MIN_BAR_WIDTH else 0
        bars = [
            (number * each, (number + 1) * each - gap, float(height), bool(key))
            for number, (height, key) in enumerate(zip(heights, intra, strict=True))
            if height
        ]
        self._bars = (made_for, bars)
        return bars


def _lanes(rates: Rates, note: str) -> list[Lane]:
    count = len(rates.rate)
    course = Course("rate", 0, rates.times[-count:], rates.rate, np.ones(count, bool))
    title = f"{note or 'in one second'}; {rates.mean:.2f} on average"
    return [Lane(course, title, lambda value: (f"{value:.2f}", "kbit/s"), theme.ACCENT)]


def _row(rates: Rates, time: float) -> int:
    """Return the position of the plane shown at a time."""
    return int(np.clip(np.searchsorted(rates.times, time + 1e-6, side="right") - 1, 0, len(rates.times) - 1))


def _table(rates: Rates) -> None:
    narrow = imgui.get_content_region_avail().x < MIN_TABLE_WIDTH
    if not imgui.begin_table("totals", 4 if narrow else 5, imgui.TableFlags_.sizing_fixed_fit):
        return
    for total in rates.totals:
        if total.planes is None and total.share < MIN_LISTED_SHARE:
            continue
        imgui.table_next_row()
        count = "" if total.planes is None else f"{total.planes} plane{'s' * (total.planes != 1)}"
        mean = f"{total.bits / total.planes:.0f} bits each" if total.planes else ""
        cells = [total.name, count, mean, f"{total.bits / 8:.0f} bytes", f"{total.share:.1%}"]
        if narrow:
            del cells[3]
        for column, text in enumerate(cells):
            imgui.table_next_column()
            imgui.text_colored(theme.FAINT if column else theme.TEXT, text)
    imgui.end_table()
    tooltip("the height of a bar is proportional to the square root of its bits")
