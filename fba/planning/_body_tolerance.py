"""A body within a tolerance: the BAPs to send, their quantiser, and what a decoder makes of the stream."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Float64, Int32, Int64
from fba.body import Skeleton
from fba.body.displacement import displacements
from fba.codec import ClampedParameter, EncoderOptions, decode, encode_animation, step_scale
from fba.encoder_options import QUANT_MAX
from fba.errors import RangeError, Remedy
from fba.parameters import BAP_COUNT, BAP_STANDARD_COUNT, FULL_TURN, bap_angles, bap_steps
from fba.planning._body_rows import BodyTarget, all_rows, blocks
from fba.planning._body_search import HOPELESS_ERROR, search_baps, turning_joints
from fba.planning._plan import encode_planned
from fba.planning._search import Effort
from fba.planning._tolerance import BodyErrors, NearLossless, Tolerance
from fba.tracks import BodyTrack, hold


@dataclass(frozen=True)
class Tuning:
    """Constants of the search. Shares are of the tolerance."""

    arm: float = 0.9  # m, from the hips to the fingers of hanging arms, which half a step of an angle moves
    reductions: tuple[float, ...] = (0.5, 0.3)  # shares that joints which are no longer turned may take
    efforts: tuple[tuple[float, float], ...] = ((0.5, 0.8), (0.7, 0.7), (0.5, 0.6))
    """Shares of a BAP and of gaps (see `Effort`) of the searches that are tried for each reduction."""
    max_left_out: int = 16  # frames left out in a row
    margins: tuple[float, ...] = (0.99, 0.93, 0.86, 0.78)
    """Shares that searches fill: the next if a search left frames beyond the tolerance."""
    max_hopeless: int = 2  # searches far beyond the tolerance after which a quantiser is too coarse
    standing: float = 0.9  # share of the feet's tolerance for half a step of the root; legs compensate
    spare: float = 0.15  # share that is left for quantisers where frames are left out
    frames_searched: int = 1600  # frames, times searches: longer streams are searched less often
    reduction_frames: int = 160  # frames by which the joints to turn are chosen; all frames check the choice


TUNING = Tuning()


def encode_body_within_tolerance(
    animation: Animation, tolerance: Tolerance, options: EncoderOptions, *, every_frame: bool
) -> tuple[bytes, NearLossless]:
    """Return a stream of a body without a face that stays within a tolerance, and its errors.

    Errors are measured on the decoded stream, where the source has frames; frames that were left out are
    interpolated, as `fba.player` does. Angles continue beyond half a turn. RangeError if not even the finest
    quantiser stays within the tolerance.
    """
    options = replace(options, clamp=True)
    smallest: tuple[bytes, NearLossless] | None = None
    nearest: BodyErrors | None = None
    clamped: Mapping[str, ClampedParameter] = {}
    for sent, chosen in body_candidates(animation, tolerance, options, gaps=not every_frame):
        streams = [encode_animation(sent, chosen), encode_planned(sent, chosen)]
        for data, statistics in sorted(streams, key=lambda stream: len(stream[0])):
            if smallest is not None and len(data) >= len(smallest[0]):
                break
            errors = body_errors(animation, decode(data, bap_steps=options.bap_steps), tolerance)
            if errors.is_within(tolerance):
                left_out = len(animation) - len(sent)
                near = NearLossless(statistics, left_out=left_out, bap_quant=chosen.bap_quant, body=errors)
                smallest = data, near
                break
            if nearest is None or errors.largest < nearest.largest:
                nearest, clamped = errors, statistics.clamped_parameters
    if smallest is None:
        assert nearest is not None
        raise beyond_body(nearest, tolerance, clamped)
    return smallest


def fit_bodies(
    animation: Animation, tolerance: Tolerance, options: EncoderOptions
) -> list[tuple[BodyTrack, int]]:
    """Return bodies within a tolerance of an animation's, and their quantisers, the cheapest first.

    All frames are sent, as streams with a face need.
    """
    body_only = replace(animation, face=None)
    fitted = []
    for sent, chosen in body_candidates(body_only, tolerance, replace(options, clamp=True), gaps=False):
        assert sent.body is not None
        size = len(encode_animation(sent, chosen)[0])
        fitted.append((size, sent.body, chosen.bap_quant))
    return [(body, quant) for _, body, quant in sorted(fitted, key=lambda fit: fit[0])]


def body_candidates(
    animation: Animation, tolerance: Tolerance, options: EncoderOptions, *, gaps: bool
) -> Iterator[tuple[Animation, EncoderOptions]]:
    """Yield animations to send that may keep a body within a tolerance, and the quantisers for them.

    The last of them has the source's values, with the coarsest quantiser that suffices. gaps: whether frames
    may be left out.
    """
    assert animation.body is not None
    count = len(animation)
    values = held_angles(animation.body)
    inner = np.zeros(count, dtype=np.bool_)
    if gaps:
        inner[1:-1] = np.diff(animation.index, n=2) == 0
        inner[1:-1] &= np.diff(animation.index)[:-1] == 1
    if values[:, :BAP_STANDARD_COUNT].any() and not values[:, BAP_STANDARD_COUNT:].any():
        yield from _searched(animation, values, inner, tolerance, options)
    for quant in range(QUANT_MAX, 0, -1):
        chosen = replace(options, bap_quant=quant)
        steps = bap_steps(options.bap_steps) * step_scale(chosen, body=True)
        rounded: Float64 = np.rint(values / steps) * steps
        sent = _to_send(animation, np.arange(count), rounded.astype(np.int32))
        off = displacements(values, rounded, float(animation.rate))
        kept = np.array_equal(rounded[:, BAP_STANDARD_COUNT:], values[:, BAP_STANDARD_COUNT:])
        within = off.joints.max() <= tolerance.joint and off.feet.max() <= tolerance.foot
        if quant == 1 or (within and kept):
            yield sent, chosen
            return


def _searched(
    animation: Animation, values: Float64, gaps: Bool, tolerance: Tolerance, options: EncoderOptions
) -> Iterator[tuple[Animation, EncoderOptions]]:
    """Yield results of searches within the tolerance; of the finest quantiser, also the first beyond it."""
    target = BodyTarget(values, float(animation.rate), tolerance)
    searches = max(TUNING.frames_searched // len(animation), 1)
    bases = [_unwrapped(reduce_joints(target, share)) for share in TUNING.reductions[:searches]]
    efforts = [(*effort, base) for effort in TUNING.efforts for base in bases][: max(searches, 2)]
    for quant in _quantisers(target, tolerance, options):
        chosen = replace(options, bap_quant=quant)
        scale = step_scale(chosen, body=True)
        steps = bap_steps(options.bap_steps) * scale
        within, hopeless = False, 0
        for share, gap_share, base in efforts:
            for margin in TUNING.margins:
                effort = Effort(
                    steps, scale, share, min(gap_share, margin - TUNING.spare), margin, TUNING.max_left_out
                )
                found = search_baps(target, base, gaps, effort)
                if found.within or found.longest > HOPELESS_ERROR:
                    break
            if found.within or (quant == 1 and not hopeless):
                within |= found.within
                yield _to_send(animation, found.keys, found.values), chosen
            hopeless += not found.within and (quant == 1 or found.longest > HOPELESS_ERROR)
            if (within and searches == 1) or hopeless == TUNING.max_hopeless:
                break
        if within:  # finer quantisers take more bits
            return


def _quantisers(target: BodyTarget, tolerance: Tolerance, options: EncoderOptions) -> list[int]:
    """Return the quantisers, coarsest first, whose half step moves nothing beyond the tolerance."""
    steps = bap_steps(options.bap_steps)
    moving = np.flatnonzero(target.values[:, :BAP_STANDARD_COUNT].any(axis=0)).tolist()
    stands = bool((target.tolerances[:, 1:] < tolerance.joint).any())
    # Feet that stand may move less, so that the root counts more.
    root = max(tolerance.joint / (TUNING.standing * tolerance.foot), 1.0) if stands else 1.0
    metres = np.where(bap_angles(), TUNING.arm * 1e-5, root * 1e-3) * steps / 2
    fitting = [
        quant
        for quant in range(QUANT_MAX, 0, -1)
        if metres[moving].max() * step_scale(replace(options, bap_quant=quant), body=True) <= tolerance.joint
    ]
    return fitting or [1]


def body_errors(source: Animation, decoded: Animation, tolerance: Tolerance) -> BodyErrors:
    """Return how far a decoded body is from its source, where the source has frames."""
    assert source.body is not None
    values = held_angles(source.body)
    shown = np.zeros((len(source), BAP_COUNT))
    if decoded.body is not None:
        sent = held_angles(decoded.body)
        frames, keys = source.index - source.index[0], decoded.index - decoded.index[0]
        for column in np.flatnonzero(sent.any(axis=0)).tolist():
            shown[:, column] = np.interp(frames, keys, sent[:, column])
    off = displacements(values, shown, float(source.rate))
    frame, joint = np.unravel_index(int(off.joints.argmax()), off.joints.shape)
    return BodyErrors(
        float(off.joints[frame, joint]),
        float(np.percentile(off.joints, 99)),
        off.share_within(tolerance.joint),
        Skeleton.default().names[joint],
        int(frame),
        float(off.feet.max()),
    )


def held_angles(body: BodyTrack) -> Float64:
    """Return the BAPs in force at every frame, float64 (T, 296), without jumps of full turns."""
    values: Int32 = hold(body.values, body.mask, np.zeros(BAP_COUNT, dtype=np.int32))
    return _unwrapped(values.astype(np.float64))


def _unwrapped(values: Float64) -> Float64:
    """Return values (T, 296) whose angles turn the shorter way round from frame to frame."""
    angles = np.flatnonzero(values.any(axis=0) & bap_angles())
    result = values.copy()
    turns = np.cumsum(-np.rint(np.diff(values[:, angles], axis=0) / FULL_TURN), axis=0)
    result[1:, angles] += turns * FULL_TURN
    return result


def _to_send(animation: Animation, keys: Int64, values: Int32) -> Animation:
    """Return the frames at keys (K,) with the BAPs (K, 296) that are not 0 throughout."""
    mask = np.broadcast_to(values.any(axis=0), values.shape)
    return replace(animation, index=animation.index[keys], face=None, body=BodyTrack(values, mask))


def beyond_body(
    nearest: BodyErrors, tolerance: Tolerance, clamped: Mapping[str, ClampedParameter] = MappingProxyType({})
) -> RangeError:
    """Return the error for a body beyond a tolerance.

    nearest: errors of the best stream. clamped: what no plane of it could carry, by parameter.
    """
    error = RangeError(
        f"no quantiser keeps the body within {tolerance.joint * 1000:g} mm, and feet that stand within "
        f"{tolerance.foot * 1000:g} mm: with the finest, a point 3 cm off {nearest.joint} is "
        f"{nearest.largest * 1000:.2f} mm off, and a foot {nearest.foot * 1000:.2f} mm; "
        + ("; ".join(map(_beyond_range, clamped.items())) or "allow that much"),
        frame=nearest.frame,
    )
    if not clamped:
        return error
    return error.with_remedies(
        Remedy("bap_steps", "take the standard's steps, which reach further, with {}", "'iso'"),
        Remedy("origin", "or let the body begin at the origin with {}", "'start'", "fba.read"),
    )


def _beyond_range(clamped: tuple[str, ClampedParameter]) -> str:
    name, values = clamped
    return f"{name} is {values.value} in frame {values.frame}, and a plane carries {values.sent} at most"


def reduce_joints(target: BodyTarget, share: float) -> Float64:
    """Return BAPs (T, 296) that turn as few joints as possible within a share of the tolerance.

    Joints below make up for those left out: a spine bends at a few vertebrae instead of all.
    """
    solver = target.solver
    rows = all_rows(solver.skeleton)
    kept, dropped = turning_joints(solver, np.asarray(target.values.any(axis=0))), list[str]()
    frames = np.unique(np.linspace(0, len(target.values) - 1, TUNING.reduction_frames).astype(int))
    matrices = solver.pose(target.values[frames])
    wanted, weights = rows.points(matrices), target.weights(rows)[frames]

    def off_without(joint: str) -> float:
        solved = solver.solve(matrices, [other for other in kept if other != joint], target.values[0])
        apart = rows.points(solver.pose(solved)) - wanted
        return float((np.linalg.norm(apart, axis=2) * weights).max())

    root = solver.skeleton.names[0]
    candidates = [joint for joint in kept if joint != root]
    while candidates:
        off = {joint: off_without(joint) for joint in candidates}
        candidates = [joint for joint in candidates if off[joint] <= share]
        if candidates:
            best = min(candidates, key=lambda joint: off[joint])
            candidates.remove(best)
            kept.remove(best)
            dropped.append(best)
    while dropped:
        reduced = _solve_joints(target, kept)
        if target.longest(reduced, rows).max(initial=0.0) <= share:
            return reduced
        kept.append(dropped.pop())
    return target.values


def _solve_joints(target: BodyTarget, joints: list[str]) -> Float64:
    """Return BAPs (T, 296) of the same poses that turn only these joints."""
    result = np.zeros_like(target.values)
    previous = target.values[0]
    for block in blocks(len(result)):
        matrices = target.solver.pose(target.values[block])
        result[block] = target.solver.solve(matrices, joints, previous)
        previous = result[block.stop - 1]
    result[:, 186:] = target.values[:, 186:]
    return result
