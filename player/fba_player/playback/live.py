"""A stream that is still arriving, as an animation that grows.

A thread reads and decodes what comes; the player sees whole frames as soon as they are there. Nothing is
thrown away, so that all of it can be seen again: an hour at 25 frames/s needs 40 MB for a face, and 135 MB
more for a body.
"""

from __future__ import annotations

import threading
import time as wall
from collections.abc import Callable
from fractions import Fraction
from typing import Any, Protocol

from fba.animation import Animation, BodyTrack, FaceTrack
from fba.arrays import Int64
from fba.codec import Decoder, FrameBuffer, StreamInfo
from fba.codec.block import Block
from fba.errors import BitstreamError, FbaError, FbaWarning
from fba_player.playback.timeline import Timeline
from fba_player.playback.transport import BUFFER

CHUNK = 1 << 16
PATIENCE = 0.5
"""Seconds after the first frame in which a slow stream may still show what it brings."""
JUDGED = 4
"""Seconds of a body after which it is judged, once, whether its BAP steps are the right ones."""


class Readable(Protocol):
    """What bytes come from: standard input's buffer, a FIFO, a socket's file."""

    def read1(self, size: int = -1, /) -> bytes:
        """What has arrived, at most so many bytes; waits for one at least, b"" at the end."""


class LiveAnimation:
    """What has arrived of an FBA stream; has the fields of `Animation`, which grow.

    source: is read by a thread of its own until its end, whatever the player does meanwhile. head: bytes
    that were already read from it. name: of the stream. bap_steps: see `fba.Decoder`. at_end: called when
    nothing more is read, to close the source.

    Damage is stepped over to the next I plane behind a start code. `message` says in few words what is wrong,
    `details` exactly; "" where nothing is. `doubt` says, once `JUDGED` seconds of a body have arrived, where
    it looks wrong with these BAP steps and right with others. Whether there is a face, or a body, is settled
    as `wait` returns.
    """

    def __init__(
        self,
        source: Readable,
        *,
        head: bytes = b"",
        name: str = "",
        bap_steps: str = "iso",
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
        self._decoder = Decoder(bap_steps=bap_steps, on_error="salvage")
        self._buffer = FrameBuffer()
        self._now = self._buffer.decoded()
        self._changed = threading.Condition()
        self._closing = False
        self._failure: BaseException | None = None
        self._losses = 0
        self._bap_steps, self._checked_bap_steps = bap_steps, False
        self._thread = threading.Thread(target=self._read, args=(head,), name="fba live", daemon=True)
        self._thread.start()

    # ---- an animation

    @property
    def rate(self) -> Fraction:
        """Frames a second."""
        return self._now.rate

    @property
    def index(self) -> Int64:
        """int64 (T,) of what has arrived."""
        return self._now.index

    @property
    def face(self) -> FaceTrack | None:
        """FAPs of what has arrived."""
        return self._now.face

    @property
    def body(self) -> BodyTrack | None:
        """BAPs of what has arrived."""
        return self._now.body

    @property
    def duration(self) -> Fraction:
        """Seconds from the first frame to one frame period after the last that has arrived."""
        now = self._now
        return Fraction(int(now.index[-1] - now.index[0]) + 1) / now.rate if len(now.index) else Fraction(0)

    def __len__(self) -> int:
        return len(self._now.index)

    def snapshot(self) -> Animation:
        """What has arrived until now, to keep. ValueError before the first frame."""
        return self._now.animation(self.name)

    # ---- a stream

    def info(self) -> StreamInfo:
        """What has arrived: planes, their bits, the bit rate. Of no parameters."""
        now, size = self._now, self.received
        first, last = (int(now.index[0]), int(now.index[-1])) if len(now.index) else (0, -1)
        return StreamInfo(
            format="fba",
            size=size,
            rate=now.rate,
            frames=len(now.index),
            duration=Fraction(last - first + 1) / now.rate,
            start=first / now.rate,
            skipped=last - first + 1 - len(now.index),
            face=None,
            body=None,
            intra_planes=int(now.plane_intra.sum()),
            plane_bits=now.plane_bits,
            plane_intra=now.plane_intra,
            frame_index=now.index,
        )

    @property
    def arrived(self) -> int:
        """Changes with every frame, and at the end."""
        return 2 * len(self) + (not self.growing)

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until it can be played: `BUFFER` seconds are there, or all. False where time ran out before.

        Raises BitstreamError or UnsupportedError where the stream ends, or is ended, without a frame that
        can be decoded, OSError where it cannot be read.
        """
        with self._changed:
            if not self._changed.wait_for(lambda: len(self) or not self.growing, timeout):
                return False
            self._changed.wait_for(self._enough, PATIENCE)
            if not len(self):
                raise self._failure or BitstreamError("the stream ended before its first I plane", plane=0)
            self._buffer.fix_parts()
        return True

    def wait_end(self, timeout: float | None = None) -> bool:
        """Wait until all has arrived. False where time, seconds, ran out before."""
        with self._changed:
            return self._changed.wait_for(lambda: not self.growing, timeout)

    def close(self) -> None:
        """Take in nothing more; the thread ends with the next bytes."""
        self._closing = True
        self._end()

    def _enough(self) -> bool:
        now = self._now
        span = int(now.index[-1] - now.index[0]) / now.rate if len(now.index) else 0
        return not self.growing or span >= BUFFER

    def _read(self, head: bytes) -> None:
        try:
            chunk = head or self._source.read1(CHUNK)
            while chunk and not self._closing:
                self.received += len(chunk)
                self._add_blocks(self._decoder.push_blocks(chunk))
                self._check_bap_steps()
                chunk = self._source.read1(CHUNK)
            if not self._closing:
                self._add_blocks(self._decoder.finish_blocks())
                self._check_bap_steps(at_end=True)
        except (FbaError, FbaWarning, OSError, ValueError) as error:
            self._failure = error
            self.message, self.details = "the stream broke off", f"the stream broke off: {error}"
        finally:
            if self._at_end is not None:
                self._at_end()
            self._end()

    def _add_blocks(self, blocks: list[Block]) -> None:
        with self._changed:
            for block in blocks:
                self._buffer.add(block)
            self._now = self._buffer.decoded()
            damage = self._decoder.damage
            if damage:
                self._failure = damage[0].error if self._failure is None else self._failure
                closed = damage[-1]
                self._losses += len(damage) - 1
                del damage[:-1]  # an endless stream may have any number
                lost = f"{closed.stop - closed.start} bytes lost at byte {closed.start}"
                before = f" ({self._losses} losses before)" if self._losses else ""
                self.message = lost + before
                self.details = f"{lost}{before}: {closed.error}"
            if self._buffer.left_out:
                self.message = f"{self._buffer.left_out} came too late to be shown"
                self.details = f"{self.message}: the stream brings it, but had none when playing started"
            self._changed.notify_all()

    def _check_bap_steps(self, *, at_end: bool = False) -> None:
        now = self._now
        if self._checked_bap_steps or now.body is None or (self.duration < JUDGED and not at_end):
            return
        from fba.body.plausibility import find_doubt

        self._checked_bap_steps = True
        self.doubt = str(find_doubt(now.body, now.index, now.rate, self._bap_steps) or "")

    def _end(self) -> None:
        with self._changed:
            self.growing = False
            self._changed.notify_all()


class LiveTimeline(Timeline):
    """What a stream shows at any time of what has arrived; hand it to `player.Scene`.

    After the last frame that has arrived, it shows that frame.
    """

    block = 256
    animation: Any

    def __init__(self, animation: LiveAnimation, model: object = None) -> None:
        super().__init__(animation, model)  # type: ignore[arg-type]

    @property
    def growing(self) -> bool:  # type: ignore[override]
        """Whether more may arrive."""
        return bool(self.animation.growing)

    @property
    def arrived(self) -> int:  # type: ignore[override]
        """Changes with every frame, and at the end."""
        return int(self.animation.arrived)


def wait_for(live: LiveAnimation, say: Callable[[str], None], after: float = 1.0) -> None:
    """`LiveAnimation.wait`, however long it takes; says so where it takes longer than that, seconds.

    Goes on listening to Ctrl-C meanwhile.
    """
    begun, said = wall.monotonic(), False
    while not live.wait(0.2):
        if not said and wall.monotonic() - begun > after:
            say(f"waiting for the first I plane of {live.name or 'the stream'}")
            said = True
