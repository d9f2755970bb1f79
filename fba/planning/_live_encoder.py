"""`LiveEncoder`: encodes frames as they come, keeps what they show, and learns what must be sent."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import permutations
from typing import Any, NamedTuple

import numpy as np

from fba.animation import Animation, Frame, check_order
from fba.arrays import Bool, Int64
from fba.codec import Encoder, EncoderOptions, EncoderStatistics, levels, quantise, range_limit, step_scale
from fba.errors import warn
from fba.face import Resolver
from fba.parameters import BAP_COUNT, FAP_COUNT, bap_angles, fill_from_mates
from fba.planning._code_lengths import BEYOND_RANGES
from fba.planning._derived_faps import derive_others, interpolated_faps, related_faps, subsets
from fba.tracks import BodyTrack, FaceTrack

WIDENING = 2
"""Factor between the largest change so far, up or down, and the reach of ranges."""
MAX_INTRA_SHARE = 0.9
"""Share of the range of I planes above which a body is far away: later I planes might not carry it."""
FAR_AWAY_STEPS = 240
"""Least reach of ranges, in quantiser steps, for a body that is far away."""


class LiveEncoder:
    """Encodes frames one by one, without knowing later frames; `push` and `finish` return complete bytes.

    The stream keeps exactly what is shown, with the quantisers in `options`: `fba.face.resolve` gives the
    same for the decoded stream as for the quantised frames, and a body has the same values. A frame is
    encoded when the next frame comes, as by `Encoder`; both decide what its plane carries.

    The encoder assumes that parameters which are 0 stay 0 (it does not send them), that FAPs which equal
    their left/right mates or their counterparts on the other contour of the lips stay equal (it leaves them
    to the player, mask type 2), and that changes stay within narrow ranges. A frame against an assumption
    becomes an I plane, which sends more and has wider ranges. Before a body is further away than I planes
    reach, an I plane sends all of it with wide ranges. From the first viseme or expression on, faces are sent
    as they come.

    Gives an FbaWarning if the first viseme or expression redefines itself, since all FAPs in force come with
    it, or if FAPs that were sent are interpolated then. Raises as `Encoder` does.
    """

    def __init__(self, options: EncoderOptions | None = None) -> None:
        self._encoder = Encoder(options)
        self._face = _FaceSource()
        self._body = _BodySource()
        self._learnt: dict[str, _Learnt] = {}
        self._waiting: _Shown | None = None

    @property
    def options(self) -> EncoderOptions:
        """The options in force."""
        return self._encoder.options

    @property
    def statistics(self) -> EncoderStatistics:
        """Counts of planes, I planes, and values clamped."""
        return self._encoder.statistics

    def push(self, frame: Frame) -> bytes:
        """Add a frame; return the bytes that are complete."""
        return self.push_animation(Animation.from_frames([frame]))

    def push_animation(self, animation: Animation) -> bytes:
        """Add frames, one after another; return the bytes that are complete."""
        return b"".join(self._push(animation[t : t + 1]) for t in range(len(animation)))

    def finish(self) -> bytes:
        """End the stream; return the last bytes. ValueError without a frame."""
        data = b""
        if self._waiting is not None:
            data = self._encode(self._waiting, None)
            self._waiting = None
        return data + self._encoder.finish()

    def ending(self) -> bytes:
        """Return what would end the stream behind the bytes returned so far; see `Encoder.ending`."""
        return self._encoder.ending()

    def _push(self, frame: Animation) -> bytes:
        if self._waiting is not None:
            check_order(self._waiting.animation, frame)
        frame = quantise(frame, self.options)
        face = None if frame.face is None else self._face.push(frame.face)
        body = None if frame.body is None else self._body.push(frame.body)
        shown = _Shown(
            replace(frame, face=face, body=body), self._face.as_it_comes, self._face.sent, self._body.sent
        )
        data = b"" if self._waiting is None else self._encode(self._waiting, shown)
        self._waiting = shown
        return data

    def _encode(self, shown: _Shown, following: _Shown | None) -> bytes:
        """Encode a frame, given the frame after it; return the bytes that are complete."""
        frame, parts = shown.animation, shown.parts
        begins = False
        for name, part in parts.items():
            learnt = self._learnt.setdefault(name, _Learnt(part.track, self.options))
            begins |= not learnt.push(part)
        if begins:
            for name, part in parts.items():
                after = {} if following is None else following.parts
                self._learnt[name].extend(part, after.get(name))
            self._encoder.begin_learning({name: learnt.limits for name, learnt in self._learnt.items()})
        sent: dict[str, Any] = {name: self._learnt[name].track_to_send(part) for name, part in parts.items()}
        data = self._encoder.push_animation(replace(frame, **sent))
        if following is not None:
            data += self._encoder.settle(int(following.animation.index[0]))
        return data


class _Part(NamedTuple):
    """The face or the body of a frame.

    source_sent: bool (N,), what the source sent so far. as_it_comes: whether the mask says what is sent. Else
    that is chosen; for a face, from what the source sent if that suffices.
    """

    track: FaceTrack | BodyTrack
    source_sent: Bool
    as_it_comes: bool = False


@dataclass(frozen=True, eq=False)
class _Shown:
    """A frame with the values that it shows. For the other fields see `_Part`."""

    animation: Animation
    face_as_it_comes: bool
    face_sent: Bool
    body_sent: Bool

    @property
    def parts(self) -> dict[str, _Part]:
        """The parts of the frame, by name."""
        parts = {}
        if self.animation.face is not None:
            parts["face"] = _Part(self.animation.face, self.face_sent, self.face_as_it_comes)
        if self.animation.body is not None:
            parts["body"] = _Part(self.animation.body, self.body_sent)
        return parts


class _FaceSource:
    """Faces that come one by one, and what they show."""

    def __init__(self) -> None:
        self._resolver = Resolver()
        self._values = np.zeros((1, FAP_COUNT), dtype=np.int32)
        self._sent = np.zeros((1, FAP_COUNT), dtype=np.bool_)
        self.as_it_comes = False

    @property
    def sent(self) -> Bool:
        """FAPs that were sent so far, bool (68,)."""
        sent: Bool = self._sent[0]
        return sent

    def push(self, face: FaceTrack) -> FaceTrack:
        """Return a face (1 frame) with the values that it shows; after a viseme or an expression, as it is.

        The first frame with a viseme or an expression sends all FAPs in force.
        """
        if self.as_it_comes:
            return face
        self._values = np.where(face.mask, face.values, self._values)
        self._sent = self._sent | face.mask
        if face.viseme.any() or face.expression.any():
            self.as_it_comes = True
            return self._all_in_force(face)
        shown = np.rint(self._resolver.push(face)).astype(np.int32)
        return FaceTrack(shown, np.arange(FAP_COUNT)[None] >= 2)

    def _all_in_force(self, face: FaceTrack) -> FaceTrack:
        """Return a frame with all FAPs that were sent so far, not only its own."""
        none = np.zeros_like(face.mask)
        interpolated = none if face.interpolated is None else face.interpolated
        added = self._sent & ~face.mask
        defines = face.viseme[0, 3] or face.expression[0, 5]
        if (added & (interpolated | bool(defines)))[:, 2:].any():
            warn(
                "the first viseme or expression of a live stream redefines itself, or comes while FAPs that "
                "were sent are interpolated; what is shown may differ from here on",
                stacklevel=6,
            )
        mask = self._sent & ~interpolated
        return FaceTrack(self._values, mask, face.viseme, face.expression, face.interpolated)


class _BodySource:
    """Bodies that come one by one. sent: bool (296,), BAPs that were sent so far."""

    def __init__(self) -> None:
        self.sent: Bool = np.zeros(BAP_COUNT, dtype=np.bool_)
        self._values = np.zeros((1, BAP_COUNT), dtype=np.int32)

    def push(self, body: BodyTrack) -> BodyTrack:
        """Return a body (1 frame) with the values that are in force."""
        self.sent = self.sent | body.mask[0]
        self._values = np.where(body.mask, body.values, self._values)
        return BodyTrack(self._values, np.ones_like(body.mask))


class _Learnt:
    """What is sent of a part, and how far it may change from one plane to the next.

    limits: int64 (N,), by how many quantiser steps P planes may raise or lower values.
    """

    def __init__(self, track: FaceTrack | BodyTrack, options: EncoderOptions) -> None:
        count = track.values.shape[1]
        self.limits: Int64 = np.zeros(count, dtype=np.int64)
        self._sent: Bool = np.zeros(count, dtype=np.bool_)
        self._used: Bool = np.zeros(
            count, dtype=np.bool_
        )  # parameters that moved, and FAPs that may copy them
        self._source_sent: Bool = np.zeros(count, dtype=np.bool_)
        self._apart: Bool = np.zeros((count, count), dtype=np.bool_)  # pairs of FAPs that were not equal
        self._largest: Int64 = np.ones(count, dtype=np.int64)  # largest changes, up or down
        self._last: Int64 = np.zeros(count, dtype=np.int64)
        self._begun = False
        self._options = options
        self._scale = step_scale(options, body=isinstance(track, BodyTrack))
        self._widest = range_limit(BEYOND_RANGES, self._scale)
        self._far = False
        # Bodies may walk away for good; angles and faces return.
        self._walks: Bool = ~bap_angles() if isinstance(track, BodyTrack) else np.zeros(count, dtype=np.bool_)

    def push(self, part: _Part) -> bool:
        """Add the next frame; return whether a P plane carries it, apart from values beyond all ranges."""
        now = self._levels(part)
        if self._begun:
            self._note_changes(now - self._last)
        self._last = now
        begun, self._begun = self._begun, True
        reach = np.abs(now) / self._widest
        if not self._far and (reach[self._walks] > MAX_INTRA_SHARE).any():
            self._far = True
            return False
        beyond = self._far or bool(
            (reach > 1)[self._sent].any()
        )  # the encoder chooses the plane that misses by less
        fits = beyond or not (self._sent & (self._largest > self.limits)).any()
        return begun and fits and self._shows(part)

    def extend(self, part: _Part, following: _Part | None) -> None:
        """Send what the last frame and the frame after it show, and widen the ranges to their changes."""
        if following is not None:
            self._note_changes(self._levels(following) - self._last)
        if part.as_it_comes:
            self._sent = part.track.mask[0]
        else:
            for shown in (part, following):
                if shown is not None and not shown.as_it_comes:
                    self._use(shown)
            self._sent = self._chosen_faps() if isinstance(part.track, FaceTrack) else self._used.copy()
        wanted = WIDENING * self._largest
        if self._far:
            wanted = np.maximum(WIDENING * wanted, FAR_AWAY_STEPS)
            self._sent = self._sent if part.as_it_comes else self._sent | part.source_sent
        self.limits = np.array([range_limit(reach, self._scale) for reach in wanted.tolist()])

    def track_to_send(self, part: _Part) -> FaceTrack | BodyTrack:
        """Return the track that is sent of a frame."""
        track, mask = part.track, self._sent[None]
        if part.as_it_comes:
            return track
        if isinstance(track, BodyTrack):
            return BodyTrack(track.values, mask)
        return FaceTrack(track.values, mask, interpolated=interpolated_faps(mask, self._used[None]))

    def _levels(self, part: _Part) -> Int64:
        """Return a frame's values in quantiser steps, int64 (N,); the last values where none are sent."""
        now = levels(part.track, self._options)[0]
        return np.where(part.track.mask[0], now, self._last) if part.as_it_comes else now

    def _note_changes(self, changes: Int64) -> None:
        """Remember the largest changes, without those that no P plane carries."""
        sizes = np.abs(changes)
        self._largest = np.maximum(self._largest, np.where(sizes > self._widest, 0, sizes))

    def _shows(self, part: _Part) -> bool:
        """Return whether what is sent suffices to show a frame."""
        track, sent = part.track, self._sent
        if part.as_it_comes:
            return bool((track.mask[0] == sent).all())
        values = track.values[0]
        shown = np.where(sent, values, 0)
        return bool(
            ((fill_from_mates(shown, sent)[0] if isinstance(track, FaceTrack) else shown) == values).all()
        )

    def _use(self, part: _Part) -> None:
        """Remember which values are not 0, which FAPs are not equal, and which the source sends."""
        values = part.track.values[0]
        used = values.astype(np.bool_)
        if isinstance(part.track, FaceTrack):
            for related in map(list, related_faps()):
                used[related] = used[related].any()
            self._apart |= values[:, None] != values[None]
            self._source_sent = part.source_sent
        self._used |= used

    def _chosen_faps(self) -> Bool:
        """Return bool (68,): the fewest FAPs that give all others, and those that were sent before.

        Once faces are sent as they come, FAPs that the source never sent must follow their mates; so they
        must not be sent before.
        """
        sent = self._sent.copy()
        sent[:2] = False
        preferred = sent | self._source_sent
        for related in related_faps():
            if not self._used[related[0]]:
                continue
            equal = {pair: np.bool_(not self._apart[pair]) for pair in permutations(related, 2)}
            before = {column for column in related if sent[column]}
            choices = [few for few in subsets(related, 1) if before.issubset(few)]
            giving = [few for few in choices if derive_others(related, few, equal, None)]
            few = next((few for few in giving if preferred[list(few)].all()), giving[0])
            sent[list(few)] = True
        return sent
