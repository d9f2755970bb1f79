"""`StreamJoiner`: planes that came over a network to an FBA stream, in which lost planes are left out."""

from __future__ import annotations

import math
import warnings
from fractions import Fraction

from fba.carriage.payloads import Unit, full_configuration
from fba.carriage.rtp import Counts
from fba.codec import Decoder, marked_table, read_plane_start, replace_time_code, time_code
from fba.errors import BitstreamError, FbaError, FbaWarning
from fba.parameters import BapTable

PATIENCE = Fraction(2)
"""Seconds after a loss for which it goes on only with a plane whose time a time code can say."""
LONGEST_GAP = 600
"""Seconds from a plane to the next beyond which times go on without a gap."""
_DEFAULT_RATE = Fraction(25)
_PLANE = b"\0\0\1\xbb"


class StreamJoiner:
    """Joins planes to a stream that a decoder reads without an error.

    Every plane is decoded, so that one that cannot be counts as lost. Behind a loss, planes are held back
    until one with which decoding may begin. Its time code is set to the time of the sender's clock, so that
    the stream shows the pose before the loss until then. Time codes are whole seconds: a plane between them
    goes on only after `PATIENCE`, and directly behind the plane before the loss.

    configuration: headers known beforehand. planes: passed on. held: held back. damaged: that were no planes.
    gaps: losses that are over. longest_gap: seconds. slipped: seconds by which times are early. table: of BAP
    steps, where the headers name it. ended: whether the end code came.
    """

    def __init__(self, configuration: bytes = b"") -> None:
        self.planes = self.held = self.damaged = self.gaps = 0
        self.longest_gap = self.slipped = Fraction(0)
        self.table: BapTable | None = None
        self.ended = False
        self._configuration = configuration
        self._repeats = False  # whether the sender repeats its headers before planes to begin at
        self._fresh = True  # begins an object
        self._waiting = True  # for a plane to begin at
        self._rate = _DEFAULT_RATE
        self._offset = Fraction(0)  # seconds of the stream at the sender's 0
        self._start = Fraction(0)  # seconds of the stream at which it begins
        self._following = Fraction(0)  # seconds of the stream at which the next plane is due
        self._lost_at = Fraction(0)  # sender's time of the first plane that was held back
        self._last = Fraction(0)  # sender's time of the last plane
        self._due = Fraction(0)  # sender's time of a plane directly behind the last that came
        self._decoder = Decoder()
        self._read = 0  # bytes that it got

    @property
    def holding(self) -> bool:
        """Whether the pose is held since planes were lost."""
        return self._waiting and self.planes > 0

    def lose(self) -> None:
        """Say that planes before the next one are lost."""
        if not self._waiting:
            self._waiting, self._lost_at = True, self._last

    def fill_in(self, counts: Counts) -> None:
        """Write what was counted here."""
        counts.planes, counts.held, counts.damaged, counts.gaps = (
            self.planes, self.held, self.damaged, self.gaps
        )  # fmt: skip
        counts.longest_gap, counts.slipped = float(self.longest_gap), float(self.slipped)
        counts.seconds = float(self._following - self._start)

    def begin_anew(self) -> None:
        """Say that the next planes are of another sender: they begin another object."""
        self.lose()
        self._fresh = True
        self._repeats = False

    def add(self, unit: Unit, time: Fraction | None) -> bytes:
        """Return what a plane adds to the stream; b"" if it is held back.

        time: seconds of the sender's clock; None if it is directly behind the plane before it.
        """
        if not unit.data:
            self.ended = True
            return b""
        try:
            return self._add(unit, time)
        except BitstreamError:
            self.damaged += 1
            self.lose()
            return b""

    def _add(self, unit: Unit, time: Fraction | None) -> bytes:
        start = read_plane_start(unit.data)
        self._repeats |= bool(unit.configuration)
        rate = start.frame_rate.fraction if start.frame_rate is not None else self._rate
        if time is None:
            time = self._due
        self._due = time + (1 + start.skip) / rate
        if not self._waiting and not 0 <= time - self._last <= LONGEST_GAP:
            self._offset = self._following - time  # the sender's clock was set
        data, code = unit.data, start.time_code
        if self._waiting:
            joinable = start.intra and (not self._repeats if unit.joinable is None else unit.joinable)
            resumed = joinable and (not self.planes or self._resumes(time, rate))
            if not resumed:
                self.held += 1
                return b""
            if not self.planes:
                self._start = Fraction(0 if code is None else code.total_seconds)
                self._offset = self._start - time
        if self.planes and start.intra and (self._waiting or code is not None):
            named = time_code(_nearest(time + self._offset, rate), rate)
            if named != code:
                data = replace_time_code(data, named)
        if not self._decodes(unit, data):
            raise BitstreamError("no plane can be decoded")
        headers = self._headers(unit)
        self.gaps += self._waiting and self.planes > 0
        self._waiting, self._rate, self._last = False, rate, time
        self._following = time + self._offset + (1 + start.skip) / rate
        self.planes += 1
        return headers + data

    def _resumes(self, time: Fraction, rate: Fraction) -> bool:
        """Whether it goes on with an I plane behind a loss; set the times if they cannot be kept."""
        moment = time + self._offset
        gap = moment - self._following
        index = _nearest(moment, rate)
        named = time_code(index, rate) is not None and index >= _nearest(self._following, rate)
        if named and 0 <= time - self._last <= LONGEST_GAP:
            self.longest_gap = max(self.longest_gap, gap)
            return True
        if not self._fresh and 0 <= time - self._lost_at < PATIENCE:
            return False
        self.slipped += max(gap, Fraction(0))
        self._offset = self._following - time
        return True

    def _decodes(self, unit: Unit, data: bytes) -> bool:
        """Whether a plane, and nothing but stuffing behind it, is decoded in its place."""
        if self._waiting:
            headers = full_configuration(unit.configuration or self._configuration)
            self._decoder, self._read = Decoder(), 0
        else:
            headers = _PLANE
        self._read += len(headers) + len(data)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", FbaWarning)  # who decodes the stream gives them
                blocks = self._decoder.push_blocks(headers + data)
        except FbaError:
            return False
        if sum(len(block.index) for block in blocks) != 1:
            return False
        rest = 8 * self._read - int(blocks[-1].borders[-1])
        return 0 < rest <= 8 and data[-1] & ((1 << rest) - 1) == (1 << rest - 1) - 1  # stuffing

    def _headers(self, unit: Unit) -> bytes:
        """Return the bytes before a plane: its start code, or those of the object that it begins."""
        if not self._fresh:
            return _PLANE
        self._fresh = False
        self._configuration = unit.configuration or self._configuration
        configuration = full_configuration(self._configuration)
        self.table = marked_table(configuration) or self.table
        return configuration


def _nearest(seconds: Fraction, rate: Fraction) -> int:
    """Return the index of the frame that is nearest to a time."""
    return math.floor(seconds * rate + Fraction(1, 2))
