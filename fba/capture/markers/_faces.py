"""`from_markers`: markers on a face as FAPs, with the head's turns, and the head's path as BAPs.

Markers may exchange their names in the middle of a take, as trackers confuse close ones: `undo_exchanges`.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import get_args

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64, Intp
from fba.capture.markers._eyes import find_gaze, opening_by_blinks
from fba.capture.markers._gaps import Filled, fill_gaps, often_seen, warn_of_gaps
from fba.capture.markers._motion import MarkerMotion
from fba.capture.markers._neutral import neutral_frames
from fba.capture.markers._registration import GIVE_MAP, Registration, complete_points, register
from fba.capture.markers._solving import choose_unknowns, measure_responses, solve
from fba.capture.markers._stabilisation import follow_head, relate_poses, remove_poses
from fba.capture.markers._targets import LOWER_LIDS, PUPILS, RIGID
from fba.capture.markers.marker_maps import check_map, find_map
from fba.choices import Gaze
from fba.errors import ModelError, OptionError, warn
from fba.face import FaceModel, Fapu
from fba.face.eyeball import limit_gaze
from fba.face.points import HEAD_PITCH, HEAD_ROLL, HEAD_YAW, PITCH_EYE, YAW_EYE
from fba.limits import DEFAULT_LIMITS, Limits
from fba.name_maps import list_names
from fba.parameters import BAP_COUNT, FAP_COUNT, point_rows
from fba.tracks import BodyTrack, FaceTrack

MIN_JUMP = 0.05
"""Smallest jump, relative to the others, of a marker that takes another's name, in sizes of the face."""
MAX_EXCHANGED_RATIO = 0.4
"""Largest ratio of the distances of two exchanged markers from each other's last places to the distances from
their own."""
MAX_JUMPS = 20
"""Largest number of markers that jump in a frame; more are a cut, or another take."""
SAMPLE_FRAMES = 100
"""Approximate number of frames from which the face's size is measured."""
MAX_EXCHANGES = 200
"""Largest number of exchanges in a take; more are noise, and none is undone."""
PATH = (181, 182, 183)
"""BAPs that move the body up, to its left, and to its front, millimetres."""
Neutral = str | int | tuple[float, float] | slice
GAZES: tuple[Gaze, ...] = get_args(Gaze)
MAX_FRAMES = 1_000_000
"""Frames of the longest capture: more than two hours at 120 frames/s."""
FRAME_BYTES = 6000
"""Memory, in bytes, for each frame."""
MARKER_BYTES = 400
"""Memory, in bytes, for each marker in a frame."""


@dataclass(frozen=True)
class Traits:
    """Properties of the points of a source.

    still: names of those that the head alone moves; None if their places tell. depth: whether their depth was
    measured; FAPs in that direction need it. confused: whether points may exchange names, as optical markers
    do. camera: whether a head that looks along z looks into the camera, from which turns then count;
    otherwise they count from the neutral face. untold: FAPs that the points do not show. rests: name ->
    frames in which a point is at its neutral place, if these are not the frames of the whole face. raised:
    name -> metres by which a point is above its neutral place even in these frames.
    """

    still: frozenset[str] | None = None
    depth: bool = True
    confused: bool = True
    camera: bool = False
    untold: frozenset[int] = frozenset()
    rests: Mapping[str, Intp] = field(default_factory=dict)
    raised: Mapping[str, float] = field(default_factory=dict)

    def find_still(self, places: Mapping[str, str]) -> list[int]:
        """Return numbers of the points in a map, name -> place, that the head alone moves."""
        still = self.still
        return [
            n for n, (name, place) in enumerate(places.items())
            if (place in RIGID if still is None else name in still)
        ]  # fmt: skip


MARKERS = Traits()


@dataclass(frozen=True, eq=False)
class MarkerFace:
    """A face found in a capture, and how it moves.

    markers: marker -> place. found_by: source of these places: a set's name, "shape", or "given".
    registration: where the face is. neutral: first frame of the neutral face, and the frame after its last.
    points: float64 (84, 3), the actor's neutral feature points, metres, in the actor's axes. fapu: the
    actor's. filled: gaps. faps: float64 (T, 68), at the capture's times. sent: the FAPs that the markers
    show. path: float64 (T, 3), metres by which the top of the spine moves to the left, up and to the front.
    """

    markers: dict[str, str]
    found_by: str
    registration: Registration
    neutral: tuple[int, int]
    points: Float64
    fapu: Fapu
    filled: Filled
    faps: Float64
    sent: tuple[int, ...]
    path: Float64


def from_markers(
    motion: MarkerMotion,
    rate: Fraction | int | str | None = None,
    *,
    markers: Mapping[str, str] | None = None,
    neutral: Neutral = "auto",
    gaze: Gaze = "none",
    head_path: bool = True,
    model: FaceModel | None = None,
    traits: Traits = MARKERS,
    limits: Limits = DEFAULT_LIMITS,
) -> Animation:
    """Return the FAPs of a face with markers, and the path of its head as BAPs 181 to 183.

    rate: frames per second; None for the capture's; values are interpolated at the times of frames. markers:
    marker -> place on the face, see `fba.capture.markers._targets`; None to find them by names, or by the
    cloud's shape. neutral: the frames in which all FAPs are 0: "auto", "first", a frame, or (from, to) in
    seconds. gaze: "none", or "camera": eyes turn against the head, so that they keep looking at the camera.
    head_path: whether the path of the head goes into the stream, too. model: the face whose motions tell
    FAPs apart; None for the built-in head. traits: of the points, if they are not markers.

    FAPs are relative to the actor's FAPU, measured on the neutral face. Lids and lips without markers are
    left to the decoder, except that the inner lips move as the outer.

    Raises ModelError where there is no face, or its motion cannot be told from the head's; OptionError;
    LimitError. Warns (FbaWarning) of everything that was repaired: units, mirrored or swapped markers, gaps.
    """
    rate = motion.rate if rate is None else Fraction(rate)
    if rate <= 0:
        raise OptionError(f"the frame rate must be positive, not {rate}")
    count = int((motion.times[-1] - motion.times[0]) * float(rate) + 1e-6) + 1 if len(motion) else 0
    limits.check_frames(count, f"the capture at {float(rate):g} frames/s")
    limits.check_bytes(
        count * (FAP_COUNT * 12 + BAP_COUNT * 6),
        f"the capture at {float(rate):g} frames/s",
        source=motion.positions.nbytes,
    )
    face = find_face(
        motion, markers=markers, neutral=neutral, gaze=gaze, model=model, traits=traits, limits=limits
    )
    at = motion.times[0] + np.arange(count) / float(rate)
    columns = np.array(face.sent, dtype=np.intp) - 1
    if not (np.abs(face.faps[:, columns]) < 2**31).all():
        raise ModelError(
            "the markers move further than FAPs can say: is their unit right, and are they a face's?"
        )
    values = np.zeros((count, FAP_COUNT), dtype=np.int32)
    mask = np.zeros((count, FAP_COUNT), dtype=bool)
    mask[:, columns] = True
    for column in columns:
        values[:, column] = np.rint(np.interp(at, motion.times, face.faps[:, column]))
    body = None
    if head_path:
        baps = np.zeros((count, BAP_COUNT), dtype=np.int32)
        sent = np.zeros((count, BAP_COUNT), dtype=bool)
        for bap, axis in zip(PATH, (1, 0, 2), strict=True):
            sent[:, bap - 1] = True
            baps[:, bap - 1] = np.rint(1000 * np.interp(at, motion.times, face.path[:, axis]))
        body = BodyTrack(baps, sent)
    return Animation(rate, np.arange(count), FaceTrack(values, mask), body, motion.name)


def find_face(
    motion: MarkerMotion,
    *,
    markers: Mapping[str, str] | None = None,
    neutral: Neutral = "auto",
    gaze: Gaze = "none",
    model: FaceModel | None = None,
    traits: Traits = MARKERS,
    limits: Limits = DEFAULT_LIMITS,
) -> MarkerFace:
    """Return the face in a capture and its motion; options and errors as for `from_markers`."""
    if gaze not in GAZES:
        raise OptionError(f"gaze must be one of {', '.join(GAZES)}, not {gaze!r}")
    _check_size(motion, limits)
    model = FaceModel.default() if model is None else model
    places, found_by = _find_places(motion, markers)
    often = often_seen(tuple(places), motion.seen[:, [motion.names.index(name) for name in places]])
    places = {name: places[name] for name in often}
    actor = _find_actor(motion, places, neutral, model, traits)
    points, moved = _measure_points(actor, motion.times, model, traits)
    try:
        fapu = Fapu.measure(points)
    except ModelError as error:
        raise ModelError(f"the neutral face: {error.finding}").with_remedies(GIVE_MAP) from error
    values, sent = _solve_features(actor, moved, points, fapu, model, traits)
    sent += _turn_head(values, actor, fapu, traits)
    sent += _turn_eyes(values, actor, moved, points, fapu, gaze)
    spine = points[point_rows()["7.1"]]
    path = np.einsum("tcd,d->tc", actor.rotation, spine) + actor.shift - spine
    return MarkerFace(
        actor.places, found_by, actor.registration, (actor.rest.start, actor.rest.stop), points, fapu,
        actor.filled, values, tuple(sorted(sent)), path,
    )  # fmt: skip


def _check_size(motion: MarkerMotion, limits: Limits) -> None:
    """Raise ModelError for no frames or too many, LimitError for a capture beyond the limits."""
    if not len(motion):
        raise ModelError("the capture has no frames")
    if len(motion) > MAX_FRAMES:
        raise ModelError(f"the capture has {len(motion)} frames, more than {MAX_FRAMES}; cut it into pieces")
    limits.check_bytes(
        len(motion) * (FRAME_BYTES + MARKER_BYTES * len(motion.names)),
        "the capture",
        source=motion.positions.nbytes,
    )


def _find_places(motion: MarkerMotion, markers: Mapping[str, str] | None) -> tuple[dict[str, str], str]:
    """Return marker -> place, and the source of these places. Raises OptionError for a wrong map."""
    if markers is None:
        return find_map(motion)
    places = dict(markers)
    check_map(places)
    missing = [name for name in places if name not in motion.names]
    if missing:
        raise OptionError(
            f"the capture has no marker {list_names(missing)}; it has {list_names(motion.names)}"
        )
    return places, "given"


@dataclass(frozen=True, eq=False)
class _Actor:
    """Markers in the actor's axes, in metres, and the motion of the head.

    places: marker -> place. registration: of the face in the capture. rest: frames of the neutral face.
    local: float64 (T, M, 3), the markers relative to the head, without gaps. rotation, shift: float64
    (T, 3, 3) and (T, 3), of the head from the neutral face. filled: gaps.
    """

    places: dict[str, str]
    registration: Registration
    rest: slice
    local: Float64
    rotation: Float64
    shift: Float64
    filled: Filled


def _find_actor(
    motion: MarkerMotion, places: dict[str, str], neutral: Neutral, model: FaceModel, traits: Traits
) -> _Actor:
    """Return the mapped markers in the actor's axes; those that are not where the map says are repaired."""
    names = tuple(places)
    positions = motion.positions[:, [motion.names.index(name) for name in names]]
    if traits.confused:
        positions, exchanges = undo_exchanges(names, positions)
        _warn_of_exchanges(exchanges)
    fixed = traits.find_still(places)
    if len(fixed) < 3:
        raise ModelError(
            "the head's motion needs three markers that the face does not move (hairline, ears, bridge of "
            f"the nose, a cap); the map has {len(fixed)}"
        ).with_remedies(GIVE_MAP)
    rotation, shift = follow_head(positions[:, fixed], motion.times)
    local = remove_poses(rotation, shift, positions)
    rest = neutral_frames(local, motion.times, neutral)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a marker that is missing in all of these frames
        still = np.nanmedian(positions[rest], axis=0)
    still = _complete_still(still, local, rotation[rest.start], shift[rest.start])
    where = register(names, places, still, model.points)
    _warn_of_repairs(motion.unit, where)
    # now to the actor's axes and metres
    turn = where.axes * where.factor
    mirror = np.array([-1.0 if where.mirrored else 1.0, 1.0, 1.0])
    positions = (positions * mirror) @ turn.T
    for one, other in where.swapped:
        a, b = names.index(one), names.index(other)
        positions[:, [a, b]] = positions[:, [b, a]]
    kept = [n for n, name in enumerate(names) if name not in where.astray]
    positions = positions[:, kept]
    places = {names[n]: places[names[n]] for n in kept}
    changed = {name for pair in where.swapped for name in pair} | set(where.astray)
    if changed & {names[n] for n in fixed}:
        fixed = traits.find_still(places)
        rotation, shift = follow_head(positions[:, fixed], motion.times)
    else:
        basis = where.axes * mirror
        rotation, shift = basis @ rotation @ basis.T, (shift * mirror) @ turn.T
    rotation, shift = relate_poses(rotation, shift, rest)
    local = remove_poses(rotation, shift, positions)
    local, filled = fill_gaps(tuple(places), local, motion.times)
    warn_of_gaps(filled)
    return _Actor(places, where, rest, local, rotation, shift, filled)


def _measure_points(
    actor: _Actor, times: Float64, model: FaceModel, traits: Traits
) -> tuple[Float64, Float64]:
    """Return the neutral feature points, float64 (84, 3), and how they move from there, (T, 84, 3)."""
    neutral = np.median(actor.local[actor.rest], axis=0)
    for n, name in enumerate(actor.places):
        if name in traits.rests:
            neutral[n] = np.median(actor.local[traits.rests[name], n], axis=0)
        neutral[n, 1] -= traits.raised.get(name, 0.0)
    columns = {place: n for n, place in enumerate(actor.places.values()) if place != "head"}
    points = complete_points({place: neutral[n] for place, n in columns.items()}, model.points)
    paths = {place: actor.local[:, n] - neutral[n] for place, n in columns.items()}
    _open_by_blinks(points, paths, times)
    moved = np.zeros((len(times), len(points), 3))
    rows = point_rows()
    for place, path in paths.items():
        if place in rows:
            moved[:, rows[place]] = path
    return points, moved


def _solve_features(
    actor: _Actor, moved: Float64, points: Float64, fapu: Fapu, model: FaceModel, traits: Traits
) -> tuple[Float64, tuple[int, ...]]:
    """Return the FAPs of all frames, float64 (T, 68), and those that the markers of the face show."""
    rows = point_rows()
    moving = [place for place in actor.places.values() if place in rows and place not in (*RIGID, *PUPILS)]
    unknowns = choose_unknowns(moving, traits.depth, traits.untold)
    if not unknowns.faps:
        return np.zeros((len(moved), FAP_COUNT)), ()
    values = solve(moved, points, fapu, unknowns, measure_responses(model))
    return values, (*unknowns.faps, *unknowns.mates)


def _turn_head(values: Float64, actor: _Actor, fapu: Fapu, traits: Traits) -> tuple[int, ...]:
    """Put the turns of the head into FAPs, float64 (T, 68); return the numbers of these FAPs."""
    turns = actor.registration.axes.T @ actor.rotation if traits.camera else actor.rotation
    values[:, [HEAD_PITCH - 1, HEAD_YAW - 1, HEAD_ROLL - 1]] = _head_angles(turns) / fapu.AU
    return HEAD_PITCH, HEAD_YAW, HEAD_ROLL


def _turn_eyes(
    values: Float64, actor: _Actor, moved: Float64, points: Float64, fapu: Fapu, gaze: Gaze
) -> tuple[int, ...]:
    """Put the turns of the eyes into FAPs (T, 68), which have the head's; return their numbers."""
    eyes = find_gaze(moved, points, set(actor.places.values()), actor.registration.scale)
    if gaze == "camera":
        yaw, pitch = -values[:, [HEAD_YAW - 1]], -values[:, [HEAD_PITCH - 1]]
    elif eyes is not None:
        yaw, pitch = eyes[:, :1] / fapu.AU, eyes[:, 1:] / fapu.AU
    else:
        return ()
    values[:, [fap - 1 for fap in YAW_EYE]] = yaw
    values[:, [fap - 1 for fap in PITCH_EYE]] = pitch
    limit_gaze(values, warn=gaze == "none")  # a head that turns away from the camera needs no warning
    return (*YAW_EYE, *PITCH_EYE)


def _open_by_blinks(points: Float64, paths: Mapping[str, Float64], times: Float64) -> None:
    """Move lower lids without markers to where blinks show them, in points, float64 (84, 3).

    paths: place -> (T, 3), the motion of its marker.
    """
    rows = point_rows()
    lids = {upper: lower for upper, lower in LOWER_LIDS.items() if upper in paths and lower not in paths}
    if not lids:
        return
    usual = np.mean([points[rows[upper], 1] - points[rows[lower], 1] for upper, lower in lids.items()])
    sunk = np.stack([-paths[upper][:, 1] for upper in lids], axis=1)
    opening = opening_by_blinks(sunk, times, float(usual))
    if opening is not None:
        for upper, lower in lids.items():
            points[rows[lower], 1] = points[rows[upper], 1] - opening


def _complete_still(still: Float64, local: Float64, rotation: Float64, shift: Float64) -> Float64:
    """Return the neutral markers (M, 3), with missing ones at their usual places.

    local: (T, M, 3), relative to the head. rotation, shift: of the head in the neutral face.
    """
    usual = [np.nanmedian(path[~np.isnan(path[:, 0])], axis=0) for path in local.swapaxes(0, 1)]
    return np.where(np.isnan(still), np.array(usual) @ rotation.T + shift, still)


def _head_angles(rotation: Float64) -> Float64:
    """Return pitch, yaw and roll, radians (T, 3), of rotations yaw . roll . pitch."""
    roll = np.arcsin(np.clip(rotation[:, 1, 0], -1.0, 1.0))
    yaw = np.unwrap(np.arctan2(-rotation[:, 2, 0], rotation[:, 0, 0]))
    pitch = np.unwrap(np.arctan2(-rotation[:, 1, 2], rotation[:, 1, 1]))
    return np.stack([pitch, yaw, roll], axis=1)


def _warn_of_repairs(unit: str, where: Registration) -> None:
    """Warn of repaired errors of the capture. unit: of the file."""
    repairs = []
    if where.factor != 1.0:
        size = where.scale / where.factor
        repairs.append(
            f"in {unit or 'metres'} the face would be {size:.3g} times as large as an adult's: "
            f"lengths are multiplied by {where.factor:g}"
        )
    if where.mirrored:
        repairs.append("the capture is mirrored: x is turned round")
    for one, other in where.swapped:
        repairs.append(f"markers {one} and {other} have each other's places: exchanged")
    if where.astray:
        repairs.append(f"far from their places on a face, and left out: {list_names(where.astray)}")
    for text in repairs:
        warn(text, stacklevel=4)


def _warn_of_exchanges(exchanges: list[Exchange]) -> None:
    """Warn of markers that exchanged their names."""
    if exchanges:
        first = exchanges[0]
        more = f", and {len(exchanges) - 1} more times in the take" if len(exchanges) > 1 else ""
        warn(
            f"markers {first.one} and {first.other} take each other's names in frame {first.frame}{more}: "
            "exchanged from there on",
            stacklevel=4,
        )


@dataclass(frozen=True)
class Exchange:
    """Two markers that exchange their names in a frame."""

    frame: int
    one: str
    other: str


def undo_exchanges(names: tuple[str, ...], positions: Float64) -> tuple[Float64, list[Exchange]]:
    """Return positions (T, M, 3) with exchanges undone, and the exchanges in order.

    positions: NaN for gaps, in any unit of length.
    """
    limit = MIN_JUMP * _size(positions[:: max(1, len(positions) // SAMPLE_FRAMES)])
    steps = np.diff(positions, axis=0)
    far = (steps**2).sum(axis=2) > limit**2  # not where a step is NaN
    fixed, found = positions, []
    for frame in np.flatnonzero(far.sum(axis=1) >= 2).tolist():
        usual = np.nanmedian(steps[frame], axis=0)  # the head's own motion
        rows = np.flatnonzero(np.linalg.norm(steps[frame] - usual, axis=1) > limit)
        if not 2 <= len(rows) <= MAX_JUMPS:
            continue
        before, after = fixed[frame, rows] + usual, fixed[frame + 1, rows]
        apart = np.linalg.norm(after[:, None] - before[None], axis=2)
        own = np.diag(apart)
        together = apart + apart.T
        together[np.diag_indices(len(rows))] = np.inf
        for a in range(len(rows)):
            b = int(together[a].argmin())
            if (
                b > a
                and together[a, b] < MAX_EXCHANGED_RATIO * (own[a] + own[b])
                and int(together[b].argmin()) == a
            ):
                if fixed is positions:
                    fixed = positions.copy()
                one, other = int(rows[a]), int(rows[b])
                fixed[frame + 1 :, [one, other]] = fixed[frame + 1 :, [other, one]]
                found.append(Exchange(frame + 1, names[one], names[other]))
                if len(found) > MAX_EXCHANGES:
                    return positions, []
    return fixed, found


def _size(positions: Float64) -> float:
    """Return the median distance of the markers from their middle; 0 where none is seen."""
    seen = ~np.isnan(positions[..., 0])
    middle = np.where(seen[..., None], positions, 0.0).sum(axis=1) / np.maximum(seen.sum(axis=1), 1)[:, None]
    away = np.linalg.norm(positions - middle[:, None], axis=2)
    return float(np.median(away[seen])) if seen.any() else 0.0
