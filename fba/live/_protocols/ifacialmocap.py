"""Datagrams of iFacialMocap and Facemotion3d: one record each, in the form of their files."""

from __future__ import annotations

import numpy as np

from fba.errors import FormatError
from fba.formats.face_tables.ifacialmocap import RATE, convert_records, find_shapes, read_records
from fba.live._protocols.sample import DatagramError, Sample

PLACE = "the record"
TIME_GAIN = 0.1
"""Share of a record's delay by which the clock is corrected."""
PERIOD_GAIN = 0.005
"""Share of a record's delay by which the period is corrected."""
MAX_DELAY = 0.25
"""Delay above which the clock is reset, seconds."""


class SteadyClock:
    """Gives steady times to records that are sent at a steady rate but arrive unevenly, as by radio.

    period: initial seconds between two records.
    """

    def __init__(self, period: float) -> None:
        self._period = self._usual = period
        self._last: float | None = None

    def time(self, now: float) -> float:
        """Return the time of a record that came at `now`: later than the time of the record before it."""
        if self._last is None:
            self._last = now
            return now
        expected = self._last + self._period
        delay = now - expected
        if abs(delay) > MAX_DELAY:
            self._period = self._usual
            self._last = max(now, self._last + self._period)
            return self._last
        self._period = min(max(self._period + PERIOD_GAIN * delay, self._usual / 4), 8 * self._usual)
        self._last = max(expected + TIME_GAIN * delay, self._last + self._usual / 8)
        return self._last


class FacialMocapReader:
    """Reads records of versions 1 and 2, which have no times; `SteadyClock` gives them."""

    def __init__(self) -> None:
        self._clock = SteadyClock(1 / RATE)
        self._shapes: list[str] | None = None
        self._newest: Sample | None = None

    def read(self, data: bytes, now: float) -> list[Sample]:
        """Return the sample of a datagram; see `DatagramReader`."""
        try:
            records, _ = read_records(data.decode("utf-8", errors="replace"), PLACE)
            shapes = find_shapes(records, PLACE) if self._shapes is None else self._shapes
            weights, head, eyes = convert_records(records[-1:], shapes)
        except FormatError as error:
            raise DatagramError("not records of iFacialMocap") from error
        if len(records) > 1:
            raise DatagramError("with several records")
        self._shapes = shapes
        seen = not any(np.isnan(part).any() for part in (weights, head, eyes) if part is not None)
        self._newest = Sample(
            self._clock.time(now), shapes, weights[0] if seen else None,
            head[0] if seen and head is not None else None, eyes[0] if seen and eyes is not None else None,
        )  # fmt: skip
        return [self._newest]

    def newest(self) -> Sample | None:
        """Return the last sample."""
        return self._newest
