"""`from_points`: tracked points of a face as FAPs."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Float64, Intp
from fba.capture.markers.faces import MarkerFace, Traits, find_face, from_markers
from fba.capture.markers.motion import MarkerMotion
from fba.capture.markers.targets import HEAD, target_points
from fba.capture.points.lifting import lift
from fba.capture.points.motion import PointMotion
from fba.capture.points.neutral import find_rests
from fba.capture.points.picture import face_misfit, upright_points
from fba.capture.points.places import (
    check_places,
    fill_points,
    find_still,
    point_places,
    take_points,
)
from fba.capture.points.sizes import even_sizes
from fba.capture.sampling import find_gaps, interpolate
from fba.errors import FbaWarning, ModelError, OptionError
from fba.face import FaceModel
from fba.limits import DEFAULT_LIMITS, Limits

Neutral = str | int | tuple[float, float]
GUESSED = frozenset({14})
"""FAPs that a depth which a tracker guesses does not tell: the jaw's thrust is lost in the chin's arc."""
MISFIT = 0.02
"""Metres by which half of the points are off a known face at most; those of real faces are 5 mm off."""
SAMPLES = 60
"""Frames, about, that tell whether points are those of a face."""
FRAME_BYTES = 400
"""Memory for each point in each frame."""


def from_points(
    motion: PointMotion,
    rate: Fraction | int | str | None = None,
    *,
    markers: Mapping[str, str] | None = None,
    neutral: Neutral = "auto",
    gaze: str = "none",
    head_path: bool = True,
    aspect: float | None = None,
    model: FaceModel | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Animation:
    """Return the FAPs of a face whose points a tracker found, and for points in metres its path as BAPs.

    markers: points -> place on the face, such as {"37+38": "3.2"}; None for the tracker's own, which
    `fba.capture.points.places.point_places` returns. aspect: of the picture, width / height, for points that
    are shares of it; None for the motion's own, or what makes the points a face. The other options, and what
    is done once pose and size are removed, are those of `fba.capture.from_markers`; pupils, where there are
    any, turn the eyes.

    Points without depth do not tell FAPs 14, 16 and 17, nor 27 and 28, and none is made up. Raises ModelError
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
    gaze: str = "none",
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
    """Points as if they were markers: in metres, of one size, in every frame; and what is known of them."""

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
    if motion.flat:  # a point somewhere on the head has a depth that nobody knows
        places = {name: place for name, place in places.items() if place != HEAD}
    still = find_still(places, motion.count)
    seen = motion.seen
    if not seen.any():
        raise ModelError(f"no face is seen in any of the {len(motion)} frames; there is nothing to encode")
    _tell_unseen(motion)
    limits.check_bytes(FRAME_BYTES * len(motion) * len(places), "the capture", source=motion.positions.nbytes)
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
        points = even_sizes(points, template, fixed)
    _check_face(points, template)
    rests: dict[str, Intp] = {}
    raised: dict[str, float] = {}
    rest: Neutral | slice = neutral
    if neutral == "auto":
        found = find_rests(points, places, template, motion.times[seen])
        if found is not None:
            rows = np.flatnonzero(seen)
            rest = slice(int(rows[found.whole.start]), int(rows[found.whole.stop - 1]) + 1)
            rests = {name: rows[found.parts[place]] for name, place in places.items() if place in found.parts}
            brows = [name for name, place in places.items() if place.startswith("4.")]
            raised = dict.fromkeys(brows, found.raised) if found.raised else {}
    elif isinstance(neutral, int) and 0 <= neutral < len(seen) and not seen[neutral]:
        raise OptionError(f"neutral: frame {neutral} has no face")
    points = _bridge(points, motion, limits)
    taken = MarkerMotion(names, points, motion.times, motion.rate, "m", "+y", motion.name)
    untold = frozenset() if motion.metric or motion.flat else GUESSED
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
    some = points[whole][:: max(1, int(whole.sum()) // SAMPLES)][:, known]
    off = face_misfit(some, template[known]) if len(some) else 0.0
    if off > MISFIT:
        raise ModelError(
            f"the points do not lie as those of a face: they are {1000 * off:.0f} mm off; are they "
            "another tracker's, or in another order?"
        )


def _bridge(points: Float64, motion: PointMotion, limits: Limits) -> Float64:
    """Return points (T, M, 3) of all frames, of those (S, M, 3) in which a face is seen."""
    seen = motion.seen
    if seen.all():
        return points
    times = motion.times[seen]
    at = np.clip(motion.times, times[0], times[-1])
    flat = points.reshape(len(points), -1)
    (bridged,) = interpolate(times, [flat], at, limits)
    return bridged.reshape(len(motion), *points.shape[1:])


def _template(places: Mapping[str, str], model: FaceModel) -> Float64:
    """Return where points are on a known face: float64 (M, 3); NaN for those somewhere on the head."""
    known = target_points(model.points)
    nowhere = np.full(3, np.nan)
    return np.array([nowhere if place == HEAD else known[place] for place in places.values()])


def _tell_unseen(motion: PointMotion) -> None:
    """Warn of frames without a face."""
    seen = motion.seen
    if seen.all():
        return
    longest = max((length for _, length in find_gaps(motion.times[seen], motion.rate)), default=0.0)
    warnings.warn(
        f"{int((~seen).sum())} of {len(seen)} frames have no face; they are bridged, {longest:.2f} s at most",
        FbaWarning, stacklevel=4,
    )  # fmt: skip
