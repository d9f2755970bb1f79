"""`encode_within_tolerance`: a stream that shows nearly the same as its source, measured after decoding."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Float64
from fba.codec import EncoderOptions, EncoderStatistics, decode
from fba.errors import FbaWarning, RangeError
from fba.face import FaceModel, known_faps, resolve
from fba.face.deform.displacements import DisplacementMeter
from fba.parameters import fap_steps, mate_columns
from fba.planning._body_tolerance import beyond_body, body_errors, encode_body_within_tolerance, fit_bodies
from fba.planning._derived_faps import interpolated_faps, related_faps
from fba.planning._face_search import Segment, search_faps
from fba.planning._mesh_error import ErrorBasis
from fba.planning._plan import Plan, encode_planned, plan_compact, plan_exact
from fba.planning._search import Effort, Found
from fba.planning._tolerance import BodyErrors, FaceErrors, NearLossless, Tolerance
from fba.tracks import FaceTrack


@dataclass(frozen=True)
class Tuning:
    """Constants of the search."""

    quantisers: tuple[int, ...] = (1, 2, 3, 4, 5, 6, 8, 10, 12)  # of FAPs, that may be tried
    max_quantisers: int = 3  # tried: the coarsest that each FAP by itself could take, and the next finer
    efforts: tuple[tuple[float, float, int], ...] = (
        (0.9, 1.1, 4), (1.1, 0.9, 4), (0.7, 1.1, 4), (0.9, 0.9, 10), (0.9, 1.1, 10), (1.1, 0.7, 4),
    )  # fmt: skip
    """Share, share of gaps, and most frames left out (see `Effort`) of the searches; the best first."""
    margin: float = 0.998  # share of the tolerance that searches fill: slopes only approximate the mesh
    max_failures: int = 3  # searches without a result after which a quantiser is given up
    as_cheap: float = 1.02  # growth of bits within which searches are coded: they only estimate these
    worse: float = 1.1  # growth of bits at a finer quantiser above which still finer ones are not tried
    frames_searched: int = 18_000  # frames, times searches: longer streams are searched less often
    intra_bits: int = 2000  # weight of an I plane: differences take less than half of those of an exact plan
    max_segment_frames: int = 3000  # frames of the longest segment, which bounds the memory of a search


TUNING = Tuning()


def encode_within_tolerance(
    animation: Animation,
    tolerance: Tolerance | None = None,
    options: EncoderOptions | None = None,
    model: FaceModel | None = None,
    *,
    every_frame: bool = False,
) -> tuple[bytes, NearLossless]:
    """Return a stream that stays within a tolerance of what an animation shows, and its errors.

    Errors are measured on the decoded stream, where the source has frames; frames that were left out are
    interpolated linearly, as `fba.player` and `Animation.resample` do. Visemes and expressions stay as they
    are. The stream is never larger than that of the preset "compact", which is taken if no other is smaller.

    A body that moves stays within the tolerance of joints and feet; if there is a face, too, all frames are
    sent.

    options: quantisers are ignored. model: the head to measure on; default: the built-in head. every_frame:
    send all frames, for players that hold a frame until the next comes. RangeError if not even the finest
    quantiser stays within the tolerance, ValueError without frames.
    """
    tolerance, options = tolerance or Tolerance(), replace(options or EncoderOptions(), fap_quant=1)
    if not len(animation):
        raise ValueError("there is no frame to encode")
    model = model or FaceModel.default()
    if animation.body is None or not animation.body.values.any():
        return _encode_face(animation, tolerance, options, model, every_frame)
    if animation.face is None:
        return encode_body_within_tolerance(animation, tolerance, options, every_frame=every_frame)
    nearest: BodyErrors | None = None
    for body, quant in fit_bodies(animation, tolerance, options):
        chosen = replace(options, bap_quant=quant, clamp=True)
        data, near = _encode_face(replace(animation, body=body), tolerance, chosen, model, every_frame)
        errors = body_errors(animation, decode(data, bap_steps=options.bap_steps), tolerance)
        if errors.is_within(tolerance):
            return data, replace(near, bap_quant=quant, body=errors)
        if nearest is None or errors.largest < nearest.largest:
            nearest = errors
    assert nearest is not None
    raise beyond_body(nearest, tolerance)


def _encode_face(
    animation: Animation, tolerance: Tolerance, options: EncoderOptions, model: FaceModel, every_frame: bool
) -> tuple[bytes, NearLossless]:
    """Return a stream whose face stays within a tolerance, and its errors; a body is sent as it is."""
    source = _Source(animation, model, options, every_frame)
    data, statistics = encode_planned(animation, options, preset="compact")
    smallest = _measured(data, statistics, source, options, compact=True)
    if animation.face is not None and _is_plain(animation.face):
        with warnings.catch_warnings(action="ignore", category=FbaWarning):  # given above
            for plan in _search(source, tolerance):
                try:
                    found_data, statistics = plan.encode()
                except RangeError:  # between frames left out, values change by more than a plane carries
                    continue
                if len(found_data) < len(data) or not _is_within(smallest, tolerance):
                    result = _measured(found_data, statistics, source, plan.options)
                    if _is_within(result, tolerance):
                        data, smallest = found_data, result
    _check(smallest, tolerance)
    return data, smallest


class _Source:
    """What is encoded, and the head that shows it."""

    def __init__(
        self, animation: Animation, model: FaceModel, options: EncoderOptions, every_frame: bool
    ) -> None:
        self.animation, self.options = animation, options
        self.may_skip = not every_frame and animation.body is None
        self.fit = model if model.fit is not None else None
        self.shown: Float64 = np.zeros((len(animation), 68))
        if animation.face is not None:
            self.shown = resolve(animation.face, self.fit).astype(np.float64)
            self.meter = DisplacementMeter(model)

    def plan(self) -> Plan:
        """Return the plan that keeps all that is shown."""
        face_only = replace(self.animation, body=None)
        with warnings.catch_warnings(action="ignore", category=FbaWarning):
            if self.fit is not None:
                return plan_exact(face_only, self.options)
            return plan_compact(face_only, self.options, intra_bits=TUNING.intra_bits)


def _is_plain(face: FaceTrack) -> bool:
    """Return whether no frame defines a viseme or an expression by the FAPs that it sends."""
    defines = face.mask[:, 0] & (face.viseme[:, 3] == 1) | face.mask[:, 1] & (face.expression[:, 5] == 1)
    return not defines.any()


def _search(source: _Source, tolerance: Tolerance) -> Iterator[Plan]:
    """Yield plans that stay within the tolerance, with different quantisers of FAPs."""
    plan = source.plan()
    face = source.animation.face
    assert face is not None
    assert plan.animation.face is not None
    basis = ErrorBasis(source.meter, tolerance)
    segments = _segments(source, plan)
    if not any(segment.groups for _, segment in segments):
        return
    efforts = min(max(TUNING.frames_searched // len(source.animation), 1), len(TUNING.efforts))
    tried, least = TUNING.max_quantisers if efforts > 1 else 1, np.inf
    for quant in reversed(TUNING.quantisers):
        if not tried:
            break
        if not all(_may_take(quant, segment, basis) for _, segment in segments):
            continue
        found = []
        for frames, segment in segments:
            results = _cheapest(segment, basis, source.meter, quant, efforts)
            if not results:
                break
            found.append((frames, results))
        else:
            tried -= 1
            for k in range(max(len(results) for _, results in found)):
                chosen = [(frames, results[min(k, len(results) - 1)]) for frames, results in found]
                yield _assemble(source, plan, segments, chosen, quant)
            bits = sum(results[0].bits for _, results in found)
            if bits > TUNING.worse * least:  # still finer ones take still more
                return
            least = min(least, bits)


def _cheapest(
    segment: Segment, basis: ErrorBasis, meter: DisplacementMeter, quant: int, efforts: int
) -> list[Found]:
    """Return the cheapest of several searches, and after it those that may take fewer bits when they are
    coded; none if the quantiser is too coarse."""
    results: list[Found] = []
    for number, (share, gap_share, most) in enumerate(TUNING.efforts[:efforts]):
        if not results and number >= TUNING.max_failures:
            break
        below = TUNING.as_cheap * min((result.bits for result in results), default=np.inf)
        effort = Effort(fap_steps() * quant, quant, share, gap_share, TUNING.margin, most)
        found = search_faps(segment, basis, meter, effort, below)
        if found.within:
            results.append(found)
    results.sort(key=lambda result: result.bits)
    return [result for result in results if result.bits < TUNING.as_cheap * results[0].bits]


def _segments(source: _Source, plan: Plan) -> list[tuple[slice, Segment]]:
    """Return the frames of a plan's segments, none of them too long, and what is sent of each."""
    track = plan.animation.face
    assert track is not None
    assert source.animation.face is not None
    values, known = known_faps(source.animation.face)
    shown_by_sent = known_faps(track)[1]
    index = source.animation.index
    consecutive = np.zeros(len(index), dtype=np.bool_)
    consecutive[1:-1] = (index[1:-1] - index[:-2] == 1) & (index[2:] - index[1:-1] == 1)
    consecutive &= ~track.mask[:, :2].any(axis=1) & source.may_skip
    result = []
    for whole in plan.segments:
        for start in range(whole.start, whole.stop, TUNING.max_segment_frames):
            frames = slice(start, min(start + TUNING.max_segment_frames, whole.stop))
            groups = _groups(track.mask[start], known[start] & shown_by_sent[start])
            gaps = consecutive[frames].copy()
            gaps[[0, -1]] = False
            segment = Segment(source.shown[frames], values[frames].astype(np.float64), groups, gaps)
            result.append((frames, segment))
    return result


def _groups(sent: Bool, known: Bool) -> dict[int, tuple[int, ...]]:
    """Return for each low-level FAP that is sent the columns that a player shows with its values."""
    groups = {int(column): [int(column)] for column in np.flatnonzero(sent) if column > 1}
    for column in np.flatnonzero(known & ~sent):
        donor = next((int(by[column]) for by in mate_columns() if sent[by[column]]), None)
        if donor in groups:
            groups[donor].append(int(column))
    return {column: tuple(columns) for column, columns in groups.items()}


def _may_take(quant: int, segment: Segment, basis: ErrorBasis) -> bool:
    """Return whether each FAP alone has a level within the tolerance at every frame that must be sent."""
    needed = ~segment.gaps
    for column, columns in segment.groups.items():
        step = int(fap_steps()[column]) * quant
        values = segment.values[needed, column]
        off = np.abs(values - np.rint(values / step) * step).max(initial=0.0)
        if off * basis.slopes(columns, segment.shown[needed]).largest > 1:
            return False
    return True


def _assemble(
    source: _Source,
    plan: Plan,
    segments: list[tuple[slice, Segment]],
    found: list[tuple[slice, Found]],
    quant: int,
) -> Plan:
    """Return the plan that sends the results of the searches."""
    animation, track, body = source.animation, plan.animation.face, source.animation.body
    assert track is not None
    moving = np.zeros(track.mask.shape[1], dtype=np.bool_)
    for _, result in found:
        moving |= result.values.any(axis=0)
    if track.mask[:, :2].any():  # a FAP that is sent as 0 overrides a viseme
        moving[:] = True
    for related in related_faps():  # and a mate that moves
        moving[list(related)] = moving[list(related)].any()
    keys = np.concatenate([frames.start + result.keys for frames, result in found])
    mask = track.mask[keys] & moving
    mask[:, :2] = track.mask[keys, :2]
    values = np.where(mask, np.concatenate([result.values for _, result in found]), 0).astype(np.int32)
    asked = interpolated_faps(mask, known_faps(track)[1][keys] & moving)
    face = FaceTrack(values, mask, track.viseme[keys], track.expression[keys], asked)
    if body is not None:
        body = replace(body, values=body.values[keys], mask=body.mask[keys])
    sent = Animation(animation.rate, animation.index[keys], face, body, animation.name)
    borders = np.cumsum([0, *(len(result.keys) for _, result in found)]).tolist()
    return Plan(
        sent, tuple(slice(*pair) for pair in pairwise(borders)), replace(source.options, fap_quant=quant)
    )


def _measured(
    data: bytes,
    statistics: EncoderStatistics,
    source: _Source,
    options: EncoderOptions,
    *,
    compact: bool = False,
) -> NearLossless:
    """Return the errors of a stream: decoded, and compared with its source."""
    decoded = decode(data, bap_steps=options.bap_steps)
    errors = None
    if source.animation.face is not None and decoded.face is not None:
        index = source.animation.index - source.animation.index[0]
        sent = decoded.index - decoded.index[0]
        if sent[-1] != index[-1]:
            raise AssertionError("a stream lasts as long as its source")
        shown = resolve(decoded.face, source.fit).astype(np.float64)
        if len(sent) < len(index):
            shown = np.stack([np.interp(index, sent, column) for column in shown.T], axis=1)
        off = source.meter.measure(source.shown, shown)
        frame = int(off.largest.argmax())
        errors = FaceErrors(
            float(off.largest[frame]), off.percentile(99), frame, int(off.worst[frame]),
            *source.meter.angles(source.shown, shown),
        )  # fmt: skip
    left_out = len(source.animation) - len(decoded)
    return NearLossless(statistics, options.fap_quant, left_out, errors, compact)


def _is_within(result: NearLossless, tolerance: Tolerance) -> bool:
    """Return whether a stream stays within a tolerance."""
    return result.face is None or result.face.is_within(tolerance)


def _check(result: NearLossless, tolerance: Tolerance) -> None:
    """Raise RangeError if a stream is not within the tolerance: no quantiser is fine enough."""
    if _is_within(result, tolerance):
        return
    assert result.face is not None
    face, mm = result.face, 1000
    raise RangeError(
        f"no quantiser keeps within {tolerance.face * mm:g} mm, {tolerance.head:g} degrees of the head and "
        f"{tolerance.gaze:g} of the eyes: the finest moves vertex {face.vertex} by "
        f"{face.largest * mm:.4f} mm, and turns the head by {face.head:.4f} and an eye by {face.gaze:.4f} "
        "degrees; allow that much, or send values unquantised, without a tolerance (fap_quant 0)",
        frame=face.frame,
    )
