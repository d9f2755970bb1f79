"""What one asks of a performance before one watches it: motion, bits, doubtful frames, blinks, emotions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from fba.animation import Animation, BodyTrack, FaceTrack
from fba.archive._performance import Performance
from fba.arrays import Array, Bool, Float32, Float64
from fba.body import BapSolver, Skeleton
from fba.body.solve.limits import DEGREES, FULL_TURN, widest_limits
from fba.codec import EncoderOptions, PartInfo, encode_animation, probe_stream
from fba.emotion import read_expressions
from fba.emotion.recogniser import TUNING
from fba.errors import FbaError
from fba.face import Deformer, FaceModel, resolve
from fba.parameters import BAP_COUNT, FAP_COUNT, bap_angles, bap_numbers, baps, fap_numbers, faps
from fba.tracks import hold

POINT_SPEED = 0.5
"""Metres a second of a point of the face, within the head, above which it jumps: lids reach 0.3."""
HEAD_SPEED = 1000.0
"""Degrees a second of the head above which it jumps."""
JOINT_SPEED = 15.0
"""Metres a second of a joint above which it jumps: fists reach 10."""
JOINT_MARGIN = 20.0
"""Degrees beyond the widest limits of a joint from which a frame is beyond them."""
FROZEN_SECONDS = 1.0
"""Time without any change from which a performance that moves elsewhere is frozen."""
MOST_SPANS = 100
"""Spans of doubtful frames that are listed."""
_LIDS = ("close_t_l_eyelid", "close_t_r_eyelid")
_HEAD = ("head_pitch", "head_yaw", "head_roll")
_AU_DEGREES = np.degrees(1e-5)


@dataclass(frozen=True)
class _Shown:
    """A performance as it is shown: all frames, without gaps; FAPs (T, 68) and BAPs (T, 296) in force."""

    animation: Animation
    faps: Float32 | None
    baps: Array | None


def describe(performance: Performance) -> dict[str, Any]:
    """Return the row of a performance in an index, see docs/archives.md. Raises BitstreamError."""
    animation = performance.decode()
    whole = animation
    if performance.planes != performance.frames:
        whole = animation.resample(animation.rate)
    face, body = whole.face, whole.body
    held = None if body is None else hold(body.values, body.mask, np.zeros(BAP_COUNT, dtype=np.int32))
    shown = _Shown(whole, None if face is None else resolve(face), held)
    doubtful = _doubtful(shown)
    seconds = performance.seconds
    row = {
        name: getattr(performance, name)
        for name in ("name", "subject", "frames", "planes", "face", "body", "seconds", "source", "key")
    }
    return row | {
        "labels": sorted(performance.labels.items()),
        "rate": float(performance.rate),
        "bytes": len(performance.stream),
        "bits_per_second": 8 * len(performance.stream) / seconds,
        "starts": len(performance.start_frames),
        "motion": sorted(_motion(shown).items()),
        "bits": sorted(_bits(performance, animation).items()),
        **{f"{kind}_frames": int(frames.sum()) for kind, frames in doubtful.items()},
        "doubtful": _spans(doubtful),
        "blinks": None if shown.faps is None else count_blinks(shown.faps, float(performance.rate)),
        **_emotions(animation),
    }


def _motion(shown: _Shown) -> dict[str, float]:
    """Return the standard deviation over time of each parameter that moves, in the standard's unit."""
    result: dict[str, float] = {}
    for values, numbers in ((shown.faps, fap_numbers()), (shown.baps, bap_numbers())):
        if values is not None:
            spread = values.std(axis=0, dtype=np.float64).tolist()
            result |= {name: spread[number - 1] for name, number in numbers.items() if spread[number - 1] > 0}
    return result


def _bits(performance: Performance, animation: Animation) -> dict[str, float]:
    """Return bits a second of each group of parameters: those of a stream with this group alone."""
    info = probe_stream(performance.stream, bap_steps=performance.bap_steps)
    options = EncoderOptions(
        fap_quant=_quant(info.face), bap_quant=_quant(info.body), bap_steps=performance.bap_steps, clamp=True,
        mark=False,
    )  # fmt: skip
    result = {}
    for part, group, columns in _groups():
        track = animation.face if part == "face" else animation.body
        if track is None or not (sent := track.mask[:, columns]).any():
            continue
        mask = np.zeros_like(track.mask)
        mask[:, columns] = sent
        values = np.where(mask, track.values, 0)
        alone: Animation
        if isinstance(track, FaceTrack):
            face = FaceTrack(values, mask, track.viseme, track.expression)
            alone = Animation(animation.rate, animation.index, face)
        else:
            alone = Animation(animation.rate, animation.index, None, BodyTrack(values, mask))
        data, _ = encode_animation(alone, options)
        result[f"{part} {group}"] = 8 * len(data) / performance.seconds
    return result


def _quant(info: PartInfo | None) -> int:
    return max(info.quants, default=1) if info is not None else 1


@cache
def _groups() -> tuple[tuple[str, str, Array], ...]:
    """Return the groups of the standard: part, name, columns."""
    found: dict[tuple[str, str], list[int]] = {}
    for part, parameters in (("face", faps()), ("body", baps())):
        for one in parameters:
            found.setdefault((part, one.group_name), []).append(one.number - 1)
    return tuple((part, name, np.array(columns)) for (part, name), columns in found.items())


def _doubtful(shown: _Shown) -> dict[str, Bool]:
    """Return bool (T,) of each kind of doubt: beyond limits, jumps, frozen."""
    count = len(shown.animation)
    limit, jump, still = (np.zeros(count, dtype=bool) for _ in range(3))
    still[1:] = True
    rate = float(shown.animation.rate)
    if shown.faps is not None:
        low, high = _fap_limits()
        limit |= ((shown.faps < low) | (shown.faps > high)).any(axis=1)
        still[1:] &= ~(shown.faps[1:] != shown.faps[:-1]).any(axis=1)
        points = _deformer().feature_points(shown.faps, local=True)
        head = [fap_numbers()[name] - 1 for name in _HEAD]
        turned = np.abs(np.diff(shown.faps[:, head].astype(np.float64), axis=0)).max(axis=1) * _AU_DEGREES
        jump[1:] |= (_steps(points) * rate > POINT_SPEED) | (turned * rate > HEAD_SPEED)
    if shown.baps is not None:
        limit |= _beyond_joints(shown.baps)
        still[1:] &= ~(shown.baps[1:] != shown.baps[:-1]).any(axis=1)
        joints = _solver().pose(shown.baps)[:, :, :3, 3]
        jump[1:] |= _steps(joints) * rate > JOINT_SPEED
    frozen = np.zeros(count, dtype=bool)
    if not still[1:].all():
        for first, last in _runs(still):
            if (last - first) / rate >= FROZEN_SECONDS:
                frozen[first:last] = True
    return {"limit": limit, "jump": jump, "frozen": frozen}


def _steps(points: Float64) -> Float64:
    """Return the farthest that a point moves from one frame to the next: (T - 1,); points may be NaN."""
    moved = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=-1))
    result: Float64 = np.where(np.isnan(moved), 0.0, moved).max(axis=1, initial=0.0)
    return result


def _beyond_joints(values: Array) -> Bool:
    """Return bool (T,): whether a joint is beyond its widest limits by the margin, whole turns apart."""
    low, high = widest_limits().T
    turning = np.flatnonzero(bap_angles() & (high > low))
    low, high = low[turning], high[turning]
    angles = values[:, turning] * DEGREES
    angles -= FULL_TURN * np.rint((angles - (low + high) / 2) / FULL_TURN)
    beyond: Bool = ((angles < low - JOINT_MARGIN) | (angles > high + JOINT_MARGIN)).any(axis=1)
    return beyond


@cache
def _fap_limits() -> tuple[Float64, Float64]:
    """Return the ranges of the standard's table of FAPs (ISO/IEC 14496-2, annex C), in FAPU; (68,) each."""
    limits = np.array([(one.i_limits or (0, 0)) for one in faps()], dtype=np.float64)
    steps = np.array([one.step for one in faps()], dtype=np.float64)
    low, high = limits[:, 0] * steps, limits[:, 1] * steps
    low[:2], high[:2] = -np.inf, np.inf
    assert len(low) == FAP_COUNT
    return low, high


@cache
def _deformer() -> Deformer:
    return Deformer(FaceModel.default())


@cache
def _solver() -> BapSolver:
    return BapSolver(Skeleton.default())


def _runs(flags: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return the runs of True: first frames, and frames behind them."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [(int(first), int(last)) for first, last in edges.reshape(-1, 2)]


def _spans(doubtful: dict[str, Bool]) -> list[dict[str, Any]]:
    spans: list[dict[str, Any]] = [
        {"kind": kind, "frame": first, "frames": last - first}
        for kind, frames in doubtful.items()
        for first, last in _runs(frames)
    ]
    return sorted(spans, key=lambda span: span["frame"])[:MOST_SPANS]


def count_blinks(shown: Float32, rate: float) -> int:
    """Return how often both upper lids shut and open again within half a second.

    shown: (T, 68), FAPs as `fba.face.resolve` returns them. rate: frames per second.
    """
    lids = shown[:, [fap_numbers()[name] - 1 for name in _LIDS]].mean(axis=1)
    longest = TUNING.blink_seconds * rate
    runs = _runs(lids > TUNING.shut_lid)
    return sum(first > 0 and last < len(lids) and last - first <= longest for first, last in runs)


def _emotions(animation: Animation) -> dict[str, Any]:
    """Return the main expression of a face, and the shares of frames of all; None without a face."""
    if animation.face is None:
        return {"emotion": None, "emotions": None}
    try:
        summary = read_expressions(animation).summary()
    except FbaError:
        return {"emotion": None, "emotions": None}
    return {
        "emotion": summary["main"],
        "emotions": sorted((one["label"], float(one["share"])) for one in summary["shares"]),
    }
