"""`from_points`: tracked points of a face as FAPs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Float64, Intp
from fba.capture.markers._faces import MarkerFace, Traits, find_face, from_markers
from fba.capture.markers._motion import MarkerMotion
from fba.capture.markers._stabilisation import fit_poses, refine_reference
from fba.capture.markers._targets import SKULL, target_points
from fba.capture.points._lifting import lift
from fba.capture.points._motion import PointMotion
from fba.capture.points._neutral import find_rests
from fba.capture.points.picture import face_misfit, upright_points
from fba.capture.points.places import check_places, fill_points, find_still, point_places, take_points
from fba.choices import Gaze
from fba.errors import ModelError, OptionError, warn
from fba.face import FaceModel
from fba.limits import DEFAULT_LIMITS, Limits
from fba.sampling import find_gaps, interpolate

Neutral = str | int | tuple[float, float]
GUESSED_DEPTH_FAPS = frozenset({14})
"""FAPs that need a measured depth: where a tracker guesses it, the jaw's thrust is lost in the chin's arc."""
MAX_MISFIT = 0.02
"""Largest median distance, in metres, of the points of a face from a known face. Real faces are 5 mm off."""
SAMPLE_FRAMES = 60
"""Approximate number of frames that are tested for being a face."""
POINT_BYTES = 400
"""Memory, in bytes, for each point in each frame."""
SIZE_ROUNDS = 2
"""Number of fits of the size, each with the rotations of the previous one."""
MEDIAN_REACH = 1
"""Number of frames before and after whose median is the size: heads approach slowly, trackers tremble."""


def from_points(
    motion: PointMotion,
    rate: Fraction | int | str | None = None,
    *,
    markers: Mapping[str, str] | None = None,
    neutral: Neutral = "auto",
    gaze: Gaze = "none",
    head_path: bool = True,
    aspect: float | None = None,
    model: FaceModel | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Animation:
    """Return the FAPs of a face whose points a tracker found, and for points in metres its path as BAPs.

    markers: points -> place on the face, such as {"37+38": "3.2"}; None for those of the tracker, see
    `fba.capture.points.places.point_places`. aspect: of the picture, width / height, for points that are
    shares of it; None for that of the motion, or the aspect with which the points are most like a face. The
    other options are those of `fba.capture.from_markers`, which makes the FAPs once pose and size are
    removed. Pupils turn the eyes.

    Points without depth do not show FAPs 14, 16, 17, 27 and 28, which are not sent then. Raises ModelError
    where there is no face; OptionError; LimitError. Warns (FbaWarning) of everything that was repaired.
    """
    made = prepare(motion, markers=markers, neutral=neutral, aspect=aspect, model=model, limits=limits)
    return from_markers(
        made.markers, motion.rate if rate is None else rate, markers=made.places, neutral=made.neutral,
        gaze=gaze, head_path=head_path and motion.metric, model=model, traits=made.traits, limits=limits,
    )  # fmt: skip


def find_point_face(
    motion: PointMotion,
    *,
    markers: Mapping[str, str] | None = None,
    neutral: Neutral = "auto",
    gaze: Gaze = "none",
    aspect: float | None = None,
    model: FaceModel | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> MarkerFace:
    """Return the face that points show and its motion; options and errors as for `from_points`."""
    made = prepare(motion, markers=markers, neutral=neutral, aspect=aspect, model=model, limits=limits)
    return find_face(
        made.markers, markers=made.places, neutral=made.neutral, gaze=gaze, model=model, traits=made.traits,
        limits=limits,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Prepared:
    """Points as if they were markers: in metres, of constant size, in every frame; and their traits."""

    markers: MarkerMotion
    places: dict[str, str]
    neutral: Neutral | slice
    traits: Traits


def prepare(
    motion: PointMotion,
    *,
    markers: Mapping[str, str] | None = None,
    neutral: Neutral = "auto",
    aspect: float | None = None,
    model: FaceModel | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Prepared:
    """Return points as if they were markers; options and errors as for `from_points`."""
    model = FaceModel.default() if model is None else model
    places = dict(point_places(motion.count) if markers is None else markers)
    check_places(places, motion.count)
    if motion.flat:  # the depth of a point somewhere on the head is unknown
        places = {name: place for name, place in places.items() if place != SKULL}
    still = find_still(places, motion.count)
    seen = motion.seen
    if not seen.any():
        raise ModelError(f"no face is seen in any of the {len(motion)} frames; there is nothing to encode")
    _warn_of_unseen(motion)
    limits.check_bytes(POINT_BYTES * len(motion) * len(places), "the capture", source=motion.positions.nbytes)
    points = take_points(motion.positions[seen], tuple(places))
    common: Bool = np.asarray(np.isfinite(points[..., 0]).any(axis=0))
    points = points[:, common]
    places = {name: place for (name, place), there in zip(places.items(), common, strict=True) if there}
    names = tuple(places)
    if motion.flat:
        points = fill_points(points)
    template = _template(places, model)
    points = upright_points(points, names, places, template, motion.share, aspect or motion.aspect)
    fixed = [n for n, name in enumerate(names) if name in still]
    if motion.flat:
        points = lift(points, places, template, motion.times[seen], model)
    elif not motion.metric:
        points = _even_sizes(points, template, fixed)
    _check_face(points, template)
    rests: dict[str, Intp] = {}
    raised: dict[str, float] = {}
    rest: Neutral | slice = neutral
    if neutral == "auto":
        neutral_face = find_rests(points, places, template, motion.times[seen])
        if neutral_face is not None:
            rows, whole, parts = np.flatnonzero(seen), neutral_face.whole, neutral_face.parts
            rest = slice(int(rows[whole.start]), int(rows[whole.stop - 1]) + 1)
            rests = {name: rows[parts[place]] for name, place in places.items() if place in parts}
            brows = [name for name, place in places.items() if place.startswith("4.")]
            raised = dict.fromkeys(brows, neutral_face.raised) if neutral_face.raised else {}
    elif isinstance(neutral, int) and 0 <= neutral < len(seen) and not seen[neutral]:
        raise OptionError(f"neutral: frame {neutral} has no face")
    points = _bridge(points, motion, limits)
    taken = MarkerMotion(names, points, motion.times, motion.rate, "m", "+y", motion.name)
    untold = frozenset() if motion.metric or motion.flat else GUESSED_DEPTH_FAPS
    traits = Traits(
        still=still,
        depth=not motion.flat,
        confused=False,
        camera=True,
        untold=untold,
        rests=rests,
        raised=raised,
    )
    return Prepared(taken, places, rest, traits)


def _check_face(points: Float64, template: Float64) -> None:
    """Raise ModelError for points (T, M, 3) that do not lie as on a face, template (M, 3)."""
    known = ~np.isnan(template[:, 0])
    whole = ~np.isnan(points[:, known]).any(axis=(1, 2))
    some = points[whole][:: max(1, int(whole.sum()) // SAMPLE_FRAMES)][:, known]
    off = face_misfit(some, template[known]) if len(some) else 0.0
    if off > MAX_MISFIT:
        raise ModelError(
            f"the points do not lie as those of a face: they are {1000 * off:.0f} mm off; are they "
            "another tracker's, or in another order?"
        )


def _bridge(points: Float64, motion: PointMotion, limits: Limits) -> Float64:
    """Return points (T, M, 3) of all frames from those (S, M, 3) of the frames with a face."""
    seen = motion.seen
    if seen.all():
        return points
    times = motion.times[seen]
    at = np.clip(motion.times, times[0], times[-1])
    flat = points.reshape(len(points), -1)
    (bridged,) = interpolate(times, [flat], at, limits)
    return bridged.reshape(len(motion), *points.shape[1:])


def _template(places: Mapping[str, str], model: FaceModel) -> Float64:
    """Return positions (M, 3) of points on a known face; NaN for those somewhere on the head."""
    targets = target_points(model.points)
    unknown = np.full(3, np.nan)
    return np.array([unknown if place == SKULL else targets[place] for place in places.values()])


def _warn_of_unseen(motion: PointMotion) -> None:
    """Warn of frames without a face."""
    seen = motion.seen
    if seen.all():
        return
    longest = max((length for _, length in find_gaps(motion.times[seen], motion.rate)), default=0.0)
    warn(
        f"{int((~seen).sum())} of {len(seen)} frames have no face; they are bridged, {longest:.2f} s at most",
        stacklevel=4,
    )


def _even_sizes(points: Float64, template: Float64, still: list[int]) -> Float64:
    """Return points of constant size, metres, as large as an adult's face.

    In units of a picture, points lie farther apart when the head comes nearer.

    points: float64 (T, M, 3), in the same unit along all axes of a frame. template: (M, 3), the points on an
    adult's face, NaN where unknown. still: numbers of those that the face does not move.
    """
    fixed = points[:, still]
    middle = np.nanmean(fixed, axis=1, keepdims=True)
    size = np.sqrt(np.nanmean((fixed - middle) ** 2, axis=(1, 2)))
    seen: Bool = np.isfinite(size) & (size > 0)
    usual = _adult_size(points[seen] / size[seen, None, None], template)
    sizes = np.where(seen, size, np.nan) * usual
    for _ in range(SIZE_ROUNDS):
        even = fixed / sizes[:, None, None]
        first = int((~np.isnan(even[..., 0])).sum(axis=1).argmax())
        reference = refine_reference(even[first].copy(), even)
        rotation, _, off = fit_poses(reference, even)
        weights = 1 / (1 + (off / (2 * np.nanmedian(off))) ** 2) ** 2
        weights = np.nan_to_num(weights * (~np.isnan(even[..., 0])))
        sizes *= _size_ratios(reference, even, rotation, weights)
    return points / _smooth_sizes(sizes)[:, None, None]


def _adult_size(points: Float64, template: Float64) -> float:
    """Return the number by which points (T, M, 3) are larger than a template (M, 3)."""
    known = ~np.isnan(template[:, 0])
    usual = np.nanmedian(points[:, known], axis=0)
    lines = np.linalg.norm(usual[:, None] - usual[None], axis=2)
    should = np.linalg.norm(template[known][:, None] - template[known][None], axis=2)
    return float(np.nansum(lines) / should.sum())


def _size_ratios(reference: Float64, even: Float64, rotation: Float64, weights: Float64) -> Float64:
    """Return the ratio of each frame's size to the reference's: float64 (T,), NaN without points."""
    known = np.nan_to_num(even)
    total = np.maximum(weights.sum(axis=1), 1e-12)[:, None]
    own = (weights @ reference) / total
    there = np.einsum("tk,tkc->tc", weights, known) / total
    turned = np.einsum("tdc,tkc->tkd", rotation, reference[None] - own[:, None])
    top = np.einsum("tk,tkc,tkc->t", weights, known - there[:, None], turned)
    bottom = np.einsum("tk,tkc,tkc->t", weights, turned, turned)
    return np.asarray(top / np.where(bottom > 0, bottom, np.nan))


def _smooth_sizes(sizes: Float64) -> Float64:
    """Return the moving median of sizes (T,); NaN stays."""
    padded = np.pad(sizes, MEDIAN_REACH, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * MEDIAN_REACH + 1)
    steady = np.nanmedian(windows, axis=1)
    return np.where(np.isnan(sizes), np.nan, steady)
