"""Markers on a face to an `Animation`: FAPs, the head's turns among them, and its path as BAPs."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import get_args

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64, Intp
from fba.capture.markers._exchanges import Exchange, undo_exchanges
from fba.capture.markers._eyes import find_gaze, opening_by_blinks
from fba.capture.markers._gaps import RARELY, Filled, fill_gaps, warn_of_gaps
from fba.capture.markers._neutral import neutral_frames
from fba.capture.markers._registration import GIVE_MAP, Registration, complete_points, register
from fba.capture.markers._responses import measure_responses
from fba.capture.markers._solving import choose_unknowns, solve
from fba.capture.markers._stabilisation import follow_head, relate_poses, remove_poses
from fba.capture.markers._targets import PUPILS, RIGID
from fba.capture.markers.marker_maps import check_map, find_map
from fba.capture.markers.motion import MarkerMotion
from fba.choices import Gaze
from fba.errors import FbaWarning, ModelError, OptionError
from fba.face import FaceModel, Fapu
from fba.face.feature_points import row_of
from fba.face.gaze import limit_gaze
from fba.face.points import HEAD_PITCH, HEAD_ROLL, HEAD_YAW, PITCH_EYE, YAW_EYE
from fba.limits import DEFAULT_LIMITS, Limits
from fba.name_maps import list_names
from fba.parameters import BAP_COUNT, FAP_COUNT
from fba.tracks import BodyTrack, FaceTrack

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
LIDS = {"3.1": "3.3", "3.2": "3.4"}
"""Upper lids, and the lower lid of the same eye."""


@dataclass(frozen=True)
class Traits:
    """What is known of the points of a source, apart from where they are.

    still: names of those that the head alone moves; None: their places tell. depth: whether it was measured
    how far forward they are; otherwise no FAP in that direction is told. confused: whether points may take
    each other's names, as optical markers do. camera: whether a head that looks along z looks into the
    camera, and turns are counted from there; otherwise from the neutral face. untold: FAPs that they do not
    tell. rests: name -> frames in which a point is where it is in a neutral face, for those whose frames are
    others than those of the whole face. raised: name -> metres by which a point is above its neutral place
    even in these frames.
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
        known = self.still
        return [
            n for n, (name, place) in enumerate(places.items())
            if (place in RIGID if known is None else name in known)
        ]  # fmt: skip


MARKERS = Traits()


@dataclass(frozen=True, eq=False)
class MarkerFace:
    """A face found in a capture, and how it moves.

    markers: marker -> place. found_by: how: a set's name, "shape", or "given". registration: where the face
    is. neutral: first frame of the neutral face, and the one after its last. points: float64 (84, 3), the
    actor's neutral feature points, metres, in the actor's axes. fapu: the actor's. filled: gaps. faps:
    float64 (T, 68), at the capture's own times. sent: the FAPs that the markers tell. path: float64 (T, 3),
    metres that the top of the spine moves to the left, up and to the front.
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

    rate: frames per second; None for the capture's own, else values are interpolated at its times. markers:
    marker -> place on the face, see `fba.capture.markers._targets`; None to find them by names, or by the
    cloud's shape. neutral: the frames in which all FAPs are 0: "auto", "first", a frame, or (from, to) in
    seconds. gaze: "none", or "camera": eyes turn against the head, so that they keep looking where they did.
    head_path: whether the path of the head goes into the stream, too. model: the face whose motions tell
    FAPs apart; None for the built-in head. traits: what is known of the points if they are not markers.

    FAPs are relative to the actor's own FAPU, measured on the neutral face. Lids and lips that no marker
    tells are left to the decoder, except that the inner lips do as the outer.

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
    """Return the face in a capture and its motion; options and errors as for `from_markers`.

    traits: what is known of the points if they are not markers.
    """
    if gaze not in GAZES:
        raise OptionError(f"gaze must be one of {', '.join(GAZES)}, not {gaze!r}")
    _check_size(motion, limits)
    model = FaceModel.default() if model is None else model
    places, found_by = _find_places(motion, markers)
    places = _without_rare(motion, places)
    actor = _find_actor(motion, places, neutral, model, traits)
    points, moved = _measure_points(actor, motion.times, model, traits)
    try:
        fapu = Fapu.measure(points)
    except ModelError as error:
        raise ModelError(f"the neutral face: {error.finding}").with_remedies(GIVE_MAP) from error
    values, sent = _solve_features(actor, moved, points, fapu, model, traits)
    sent += _turn_head(values, actor, fapu, traits)
    sent += _turn_eyes(values, actor, moved, points, fapu, gaze)
    spine = points[row_of()["7.1"]]
    path = np.einsum("tcd,d->tc", actor.rotation, spine) + actor.shift - spine
    return MarkerFace(
        actor.places, found_by, actor.where, (actor.rest.start, actor.rest.stop), points, fapu, actor.filled,
        values, tuple(sorted(sent)), path,
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
    """Return the places of markers, by name, and what says so. Raises OptionError for a map that is wrong."""
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

    places: marker -> place. where: the face in the capture. rest: frames of the neutral face. local: float64
    (T, M, 3), the markers relative to the head, without gaps. rotation, shift: float64 (T, 3, 3) and (T, 3),
    the head's, from the neutral face. filled: gaps.
    """

    places: dict[str, str]
    where: Registration
    rest: slice
    local: Float64
    rotation: Float64
    shift: Float64
    filled: Filled


def _find_actor(
    motion: MarkerMotion, places: dict[str, str], neutral: Neutral, model: FaceModel, traits: Traits
) -> _Actor:
    """Return the markers of a map as the actor's; those that are not where the map says are repaired."""
    names = tuple(places)
    positions = motion.positions[:, [motion.names.index(name) for name in names]]
    if traits.confused:
        positions, exchanges = undo_exchanges(names, positions)
        _tell_exchanges(exchanges)
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
    _tell(motion, where)
    # from here on in the actor's axes and in metres
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
    local, names = actor.local, tuple(actor.places)
    neutral = np.median(local[actor.rest], axis=0)
    for n, name in enumerate(names):
        if name in traits.rests:
            neutral[n] = np.median(local[traits.rests[name], n], axis=0)
        neutral[n, 1] -= traits.raised.get(name, 0.0)
    placed = {place: neutral[n] for n, place in enumerate(actor.places.values()) if place != "head"}
    points = complete_points(placed, model.points)
    _open_by_blinks(points, actor.places, names, local - neutral, times)
    moved = np.zeros((len(local), len(points), 3))
    rows = row_of()
    for n, place in enumerate(actor.places.values()):
        if place in rows:
            moved[:, rows[place]] = local[:, n] - neutral[n]
    return points, moved


def _solve_features(
    actor: _Actor, moved: Float64, points: Float64, fapu: Fapu, model: FaceModel, traits: Traits
) -> tuple[Float64, tuple[int, ...]]:
    """Return the FAPs of all frames, float64 (T, 68), and which of them the face's own markers tell."""
    rows = row_of()
    told = [place for place in actor.places.values() if place in rows and place not in (*RIGID, *PUPILS)]
    unknowns = choose_unknowns(told, traits.depth, traits.untold)
    if not unknowns.faps:
        return np.zeros((len(moved), FAP_COUNT)), ()
    values = solve(moved, points, fapu, unknowns, measure_responses(model))
    return values, (*unknowns.faps, *unknowns.mates)


def _turn_head(values: Float64, actor: _Actor, fapu: Fapu, traits: Traits) -> tuple[int, ...]:
    """Put the turns of the head into FAPs, float64 (T, 68); return which these are."""
    turns = actor.where.axes.T @ actor.rotation if traits.camera else actor.rotation
    values[:, [HEAD_PITCH - 1, HEAD_YAW - 1, HEAD_ROLL - 1]] = _head_angles(turns) / fapu.AU
    return HEAD_PITCH, HEAD_YAW, HEAD_ROLL


def _turn_eyes(
    values: Float64, actor: _Actor, moved: Float64, points: Float64, fapu: Fapu, gaze: Gaze
) -> tuple[int, ...]:
    """Put the turns of the eyes into FAPs, float64 (T, 68), which hold the head's; return which these are."""
    eyes = find_gaze(moved, points, set(actor.places.values()), actor.where.scale)
    if gaze == "camera":
        yaw, pitch = -values[:, [HEAD_YAW - 1]], -values[:, [HEAD_PITCH - 1]]
    elif eyes is not None:
        yaw, pitch = eyes[:, :1] / fapu.AU, eyes[:, 1:] / fapu.AU
    else:
        return ()
    values[:, [fap - 1 for fap in YAW_EYE]] = yaw
    values[:, [fap - 1 for fap in PITCH_EYE]] = pitch
    limit_gaze(values, warn=gaze == "none")  # by the camera's gaze, a head that turns away leaves the camera
    return (*YAW_EYE, *PITCH_EYE)


def _open_by_blinks(
    points: Float64, places: Mapping[str, str], names: Sequence[str], moved: Float64, times: Float64
) -> None:
    """Move lower lids without a marker to where blinks say that they are, in points, float64 (84, 3)."""
    rows, placed = row_of(), {places[name]: n for n, name in enumerate(names)}
    lids = {upper: lower for upper, lower in LIDS.items() if upper in placed and lower not in placed}
    if not lids:
        return
    usual = np.mean([points[rows[upper], 1] - points[rows[lower], 1] for upper, lower in lids.items()])
    sunk = -moved[:, [placed[upper] for upper in lids], 1]
    opening = opening_by_blinks(sunk, times, float(usual))
    if opening is not None:
        for upper, lower in lids.items():
            points[rows[lower], 1] = points[rows[upper], 1] - opening


def _without_rare(motion: MarkerMotion, places: dict[str, str]) -> dict[str, str]:
    """Return the map without markers that are hardly ever seen; warns of them."""
    share = motion.seen.mean(axis=0)
    rare = [name for name in places if share[motion.names.index(name)] < RARELY]
    if rare:
        warnings.warn(
            f"seen in less than {RARELY:.0%} of the frames, and left out: {list_names(rare)}",
            FbaWarning, stacklevel=4,
        )  # fmt: skip
    return {name: place for name, place in places.items() if name not in rare}


def _complete_still(still: Float64, local: Float64, rotation: Float64, shift: Float64) -> Float64:
    """Return the neutral markers (M, 3); those missing then are where they are most of the time.

    local: (T, M, 3), relative to the head; rotation, shift: the head's in the neutral face.
    """
    usual = [np.nanmedian(path[~np.isnan(path[:, 0])], axis=0) for path in local.swapaxes(0, 1)]
    return np.where(np.isnan(still), np.array(usual) @ rotation.T + shift, still)


def _head_angles(rotation: Float64) -> Float64:
    """Return pitch, yaw and roll, radians (T, 3), of rotations yaw . roll . pitch."""
    roll = np.arcsin(np.clip(rotation[:, 1, 0], -1.0, 1.0))
    yaw = np.unwrap(np.arctan2(-rotation[:, 2, 0], rotation[:, 0, 0]))
    pitch = np.unwrap(np.arctan2(-rotation[:, 1, 2], rotation[:, 1, 1]))
    return np.stack([pitch, yaw, roll], axis=1)


def _tell(motion: MarkerMotion, where: Registration) -> None:
    """Warn of what was wrong with the capture and is repaired."""
    said = []
    if where.factor != 1.0:
        stored = motion.unit or "metres"
        said.append(
            f"in {stored} the face would be {where.scale / where.factor:.3g} times as large as an adult's: "
            f"lengths are multiplied by {where.factor:g}"
        )
    if where.mirrored:
        said.append("the capture is mirrored: x is turned round")
    for one, other in where.swapped:
        said.append(f"markers {one} and {other} have each other's places: exchanged")
    if where.astray:
        said.append(f"far from their places on a face, and left out: {list_names(where.astray)}")
    for text in said:
        warnings.warn(text, FbaWarning, stacklevel=4)


def _tell_exchanges(exchanges: list[Exchange]) -> None:
    """Warn of markers that took each other's names."""
    if exchanges:
        first = exchanges[0]
        more = f", and {len(exchanges) - 1} more times in the take" if len(exchanges) > 1 else ""
        warnings.warn(
            f"markers {first.one} and {first.other} take each other's names in frame {first.frame}{more}: "
            "exchanged from there on",
            FbaWarning, stacklevel=4,
        )  # fmt: skip
