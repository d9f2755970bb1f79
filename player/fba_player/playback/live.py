"""An animation that grows while its stream is still arriving.

A thread reads and decodes the stream; the player sees each frame as soon as it is complete. All frames stay
in memory, so that all of them can be played again: an hour at 25 frames/s needs 40 MB for a face, and 135 MB
more for a body.
"""

from __future__ import annotations

import threading
import time as wall
from collections.abc import Callable
from fractions import Fraction
from typing import Any, Protocol, cast

from fba.animation import Animation, BodyTrack, FaceTrack
from fba.arrays import Int64
from fba.choices import BapTableOrAuto
from fba.codec import Block, DecodedFrames, Decoder, FrameBuffer, StreamInfo, marked_table
from fba.errors import BitstreamError, FbaError, FbaWarning
from fba.face import FaceSettings
from fba.formats.step_choice import choose_steps
from fba.parameters import BAP_STEPS_AUTO, BAP_STEPS_DEFAULT
from fba_player.playback._timeline import Timeline
from fba_player.playback._transport import BUFFER_SECONDS

CHUNK_BYTES = 1 << 16
"""Bytes read at once, at most."""
PATIENCE_SECONDS = 0.5
"""Seconds that `wait` gives a slow stream to fill the buffer and to show whether it has a face and a body."""
CHECK_BAP_STEPS_AFTER = 4
"""Seconds of a body after which it is checked, once, whether they look right with these BAP steps."""
CHOOSE_BAP_STEPS_AFTER = 1.25
"""Seconds of a body after which the BAP steps are chosen by how it moves; nothing is shown before. A file in
a pipe arrives faster: its end, with the mark, comes within `PATIENCE_SECONDS`."""
MARK_BYTES = 64
"""More than a mark and its start code take."""


class Readable(Protocol):
    """A source of bytes: standard input's buffer, a FIFO, a socket's file."""

    def read1(self, size: int = -1, /) -> bytes:
        """Return at most `size` bytes that have arrived, after waiting for at least one; b"" at the end."""


class LiveAnimation:
    """The part of an FBA stream that has arrived; it has the fields of `Animation`, which grow.

    source: read by a thread until its end, whatever the player does meanwhile. head: bytes that were already
    read from it. name: of the stream. bap_steps: "iso" or "visage"; or "auto": those that a mark before the
    object names, or behind it if the end comes within `PATIENCE_SECONDS`; else they are chosen from the first
    `CHOOSE_BAP_STEPS_AFTER` seconds of a body, for which nothing is shown. at_end: called when nothing more
    is read, to close the source.

    `bap_steps` is then the table used; `steps_explanation` says why, or is "" where it makes no difference.

    After damage, decoding goes on at the next I plane behind a start code. `message` says in a few words what
    is wrong, `details` gives the full error; both are "" where nothing is. `doubt` is set once
    `CHECK_BAP_STEPS_AFTER` seconds of a body have arrived, if it looks wrong with these BAP steps and right
    with others; never if the stream has said by then that these are its steps. Whether there is a face or a
    body is fixed when `wait` returns.
    """

    def __init__(
        self,
        source: Readable,
        *,
        head: bytes = b"",
        name: str = "",
        bap_steps: BapTableOrAuto = "iso",
        at_end: Callable[[], None] | None = None,
    ) -> None:
        self.name = name
        self.message = ""
        self.details = ""
        self.doubt = ""
        self.growing = True
        self.received = 0
        """Bytes that have arrived."""
        self._source = source
        self._at_end = at_end
        self.bap_steps = BAP_STEPS_DEFAULT if bap_steps == BAP_STEPS_AUTO else bap_steps
        self.steps_explanation = ""
        # What arrives before they are chosen:
        self._held: bytearray | None = bytearray() if bap_steps == BAP_STEPS_AUTO else None
        self._held_blocks: list[Block] = []
        self._held_since: float | None = None  # when the first block came
        asked = None if bap_steps == BAP_STEPS_AUTO else bap_steps
        self._decoder = Decoder(bap_steps=asked, on_error="salvage")
        self._buffer = FrameBuffer()
        self._now = self._buffer.decoded()
        self._changed = threading.Condition()
        self._closing = False
        self._failure: BaseException | None = None
        self._losses = 0
        self._source_tells = False
        self._checked_bap_steps = bap_steps == BAP_STEPS_AUTO
        self._thread = threading.Thread(target=self._read, args=(head,), name="fba live", daemon=True)
        self._thread.start()

    @property
    def rate(self) -> Fraction:
        """Frames a second."""
        return self._now.rate

    @property
    def index(self) -> Int64:
        """Frame numbers that have arrived, int64 (T,)."""
        return self._now.index

    @property
    def face(self) -> FaceTrack | None:
        """FAPs that have arrived; None for a stream without a face."""
        return self._now.face

    @property
    def body(self) -> BodyTrack | None:
        """BAPs that have arrived; None for a stream without a body."""
        return self._now.body

    @property
    def duration(self) -> Fraction:
        """Seconds from the first frame to one frame period after the last that has arrived."""
        now = self._now
        return Fraction(int(now.index[-1] - now.index[0]) + 1) / now.rate if len(now.index) else Fraction(0)

    def __len__(self) -> int:
        return len(self._now.index)

    @property
    def now(self) -> DecodedFrames:
        """All that has arrived, at one moment; not copied."""
        return self._now

    def snapshot(self) -> Animation:
        """Return a copy of what has arrived so far. Raises ValueError before the first frame."""
        return self._now.animation(self.name)

    def info(self) -> StreamInfo:
        """Return the planes that have arrived, their bits and the bit rate, but no parameters."""
        now, size = self._now, self.received
        first, last = (int(now.index[0]), int(now.index[-1])) if len(now.index) else (0, -1)
        return StreamInfo(
            format="fba", size=size, rate=now.rate, frames=len(now.index),
            duration=Fraction(last - first + 1) / now.rate, start=first / now.rate,
            skipped=last - first + 1 - len(now.index), face=None, body=None,
            intra_planes=int(now.plane_intra.sum()), plane_bits=now.plane_bits, plane_intra=now.plane_intra,
            frame_index=now.index,
        )  # fmt: skip

    @property
    def arrived(self) -> int:
        """A counter that changes with every frame, and at the end."""
        return 2 * len(self) + (not self.growing)

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until it can be played: `BUFFER_SECONDS`, or the whole stream, have arrived. timeout: seconds.

        Returns False after the timeout. Raises BitstreamError or UnsupportedError where the stream ends, or
        is closed, without a frame that can be decoded, OSError where it cannot be read.
        """
        with self._changed:
            if not self._changed.wait_for(
                lambda: len(self) or self._held_blocks or not self.growing, timeout
            ):
                return False
            self._changed.wait_for(self._enough, PATIENCE_SECONDS)
            self._choose_bap_steps()
            if not len(self):
                raise self._failure or BitstreamError("the stream ended before its first I plane", plane=0)
            self._buffer.fix_parts()
        return True

    def wait_end(self, timeout: float | None = None) -> bool:
        """Wait until the stream has ended. timeout: seconds; return False after it."""
        with self._changed:
            return self._changed.wait_for(lambda: not self.growing, timeout)

    def tell(self, message: str) -> None:
        """Show a message of the source, such as that a part of the stream was lost.

        It knows more of that than the decoder, whose findings are `details` alone from then on.
        """
        self.message = message
        self._source_tells = True

    def close(self) -> None:
        """Stop reading; the thread ends with the next bytes."""
        self._closing = True
        self._end()

    def _enough(self) -> bool:
        now = self._now
        span = int(now.index[-1] - now.index[0]) / now.rate if len(now.index) else 0
        return not self.growing or span >= BUFFER_SECONDS

    def _read(self, head: bytes) -> None:
        try:
            chunk = head or self._source.read1(CHUNK_BYTES)
            while chunk and not self._closing:
                self.received += len(chunk)
                self._decode(chunk)
                self._check_bap_steps()
                chunk = self._source.read1(CHUNK_BYTES)
            if not self._closing:
                with self._changed:
                    self._choose_bap_steps()
                    self._add_blocks(self._decoder.finish_blocks())
                self._check_bap_steps(at_end=True)
        except (FbaError, FbaWarning, OSError, ValueError) as error:
            self._failure = error
            self.message, self.details = "the stream broke off", f"the stream broke off: {error}"
        finally:
            if self._at_end is not None:
                self._at_end()
            self._end()

    def _decode(self, chunk: bytes) -> None:
        """Add what a chunk brings, or withhold it while the BAP steps are not chosen."""
        with self._changed:
            self._checked_bap_steps |= marked_table(chunk) == self.bap_steps
            if self._held is None:
                self._add_blocks(self._decoder.push_blocks(chunk))
                return
            self._held += chunk
            if self._is_marked(len(chunk)):
                self._choose_bap_steps(whole=True)
                return
            self._held_blocks += self._decoder.push_blocks(chunk)
            bodies = [block for block in self._held_blocks if block.settings.body is not None]
            seconds = sum(len(block.index) / block.rate for block in bodies)
            if self._held_blocks:
                now = wall.monotonic()
                self._held_since = now if self._held_since is None else self._held_since
                waited = seconds >= CHOOSE_BAP_STEPS_AFTER and now - self._held_since >= PATIENCE_SECONDS
                if not bodies or waited:
                    self._choose_bap_steps()
            self._changed.notify_all()

    def _is_marked(self, new: int) -> bool:
        """Return whether the withheld bytes contain a mark. new: bytes at their end not searched yet."""
        assert self._held is not None
        begin = max(len(self._held) - new - MARK_BYTES, 0)
        return b"bap_steps=" in self._held[begin:] and marked_table(self._held) is not None

    def _choose_bap_steps(self, *, whole: bool = False) -> None:
        """Choose the BAP steps, if they are not chosen yet, and add what was withheld.

        whole: decode all of it again, as the decoder has not read the last chunk.
        """
        if self._held is None:
            return
        held, blocks = bytes(self._held), self._held_blocks
        self._held, self._held_blocks = None, []
        choice = choose_steps(held)
        self.steps_explanation = choice.explanation
        if whole or choice.table != self.bap_steps:
            self.bap_steps = choice.table
            self._decoder = Decoder(bap_steps=choice.table, on_error="salvage")
            blocks = self._decoder.push_blocks(held)
        self._add_blocks(blocks)

    def _add_blocks(self, blocks: list[Block]) -> None:
        with self._changed:
            for block in blocks:
                self._buffer.add(block)
            self._now = self._buffer.decoded()
            self._check_mark()
            damage = self._decoder.damage
            if damage:
                self._failure = damage[0].error if self._failure is None else self._failure
                closed = damage[-1]
                self._losses += len(damage) - 1
                del damage[:-1]  # an endless stream may have any number
                amount = f"{closed.stop - closed.start} bytes" if closed.stop > closed.start else "frames"
                lost = f"{amount} lost at byte {closed.start}"
                count = f"{self._losses} loss{'es' if self._losses > 1 else ''}"
                before = f" ({count} before)" if self._losses else ""
                self.message = self.message if self._source_tells else lost + before
                self.details = f"{lost}{before}: {closed.error}"
            if self._buffer.left_out:
                self.message = f"{self._buffer.left_out} came too late to be shown"
                self.details = f"{self.message}: the stream brings it, but had none when playing started"
            self._changed.notify_all()

    def _check_mark(self) -> None:
        """Report a mark at the end of the stream that names other BAP steps than those shown."""
        named = self._decoder.mark
        if named is None or named == self.bap_steps or self._now.body is None:
            return
        self.message = f"BAP steps {self.bap_steps} are wrong"
        self.details = (
            f"{self.message}: the stream says at its end that it was made with {named}; play it with "
            f"--bap-steps {named}"
        )

    def _check_bap_steps(self, *, at_end: bool = False) -> None:
        now, due = self._now, at_end or self.duration >= CHECK_BAP_STEPS_AFTER
        if self._checked_bap_steps or now.body is None or not due:
            return
        from fba.body.plausibility import find_doubt

        self._checked_bap_steps = True
        self.doubt = str(find_doubt(now.body, now.index, now.rate, self.bap_steps) or "")

    def _end(self) -> None:
        with self._changed:
            self.growing = False
            self._changed.notify_all()


class LiveTimeline(Timeline):
    """The timeline of a `LiveAnimation`; hand it to `fba.player.Scene`.

    After the last frame that has arrived, it shows that frame.
    """

    block = 256
    animation: Any

    def __init__(self, animation: LiveAnimation, model: FaceSettings | None = None) -> None:
        super().__init__(cast(Animation, animation), model)


def wait_for(live: LiveAnimation, say: Callable[[str], None], after: float = 1.0) -> None:
    """Wait for a live animation, however long it takes; Ctrl-C works meanwhile.

    say: called once with a message where it takes longer than `after` seconds. Raises as
    `LiveAnimation.wait`.
    """
    begun, said = wall.monotonic(), False
    while not live.wait(0.2):
        if not said and wall.monotonic() - begun > after:
            say(f"waiting for the first I plane of {live.name or 'the stream'}")
            said = True
