"""A user's performance in an actor's style: the mask of each part in each frame, and the resulting FAPs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Float64, Intp
from fba.choices import Means
from fba.errors import OptionError, did_you_mean, warn
from fba.parameters import FAP_COUNT
from fba.persona._curves import CurveMap, fit_curves, general_curves
from fba.persona._observation import Neutral, Observation, observe
from fba.persona._persona import MEANS, PartStyle, Persona
from fba.persona._restyle import keep_shut, restyle
from fba.persona.motion import flatten, unflatten
from fba.persona.points import TrackedFace, mask_distance
from fba.persona.points.layout import PARTS, part_points, part_vertices, standard_mask
from fba.persona.recognition import ClassRecogniser, Labels
from fba.persona.recognition._faps import face_scale, mask_faps, measure_fapu, shown_numbers
from fba.tracks import FaceTrack

HEAD = (48, 49, 50)
"""FAPs of the head's turns, which stay the user's."""
KEY_INSET = 2
"""Frames from the start and from the end of a run of one mask to its keys; between keys, masks blend."""
BLOCK = 256
"""Number of frames whose distances from masks are computed at once."""
DEFAULT_MEANS: Means = "motion"
MAPPED = ("motion", "curves")
"""Means without masks: every frame is a key."""


@dataclass(frozen=True, eq=False)
class Performance:
    """A user's performance in an actor's style.

    rows: int (S,), numbers of the frames in which the user is seen. own, acted: float64 (S, 86, 3),
    displacements from the neutral mask, millimetres, of the user and in the actor's style. labels: part ->
    the user's classes. used: part -> label of the mask that is shown, "" without one. chosen: part -> int
    (S,), number of that mask, -1 for none. keys: part -> bool (S,), the frames between which masks are
    interpolated.
    """

    rows: Intp
    own: Float64
    acted: Float64
    labels: dict[str, list[str]]
    used: dict[str, list[str]]
    chosen: dict[str, Intp]
    keys: dict[str, Bool]

    def key_frames(self) -> list[tuple[int, dict[str, int]]]:
        """Return (frame, part -> number of the mask) for the frames in which any part has a key."""
        result = []
        for n, row in enumerate(self.rows.tolist()):
            given = {part: int(self.chosen[part][n]) for part in PARTS if self.keys[part][n]}
            if given:
                result.append((row, given))
        return result


def transfer(
    face: TrackedFace,
    persona: Persona,
    *,
    means: Means = DEFAULT_MEANS,
    neutral: Neutral = None,
    user: Persona | None = None,
    recogniser: ClassRecogniser | None = None,
) -> Performance:
    """Return a user's performance in an actor's style.

    means: "motion", "curves", or "masks" (the nearest mask of the user's class, as in the source). neutral:
    the user's neutral frames, see `observe`. user: the user's Persona, which gives the user's usual style; by
    default that of people in general, with amplitude and speed of this performance. Raises ModelError,
    OptionError. Warns where a Persona has no statistics of motion: "curves" then replace "motion".
    """
    means = usable_means(persona, means)
    recogniser = ClassRecogniser.default() if recogniser is None else recogniser
    seen = observe(face, recogniser, neutral)
    own, here = seen.mask_motion(recogniser), measure_fapu(seen.neutral)
    acted = np.zeros_like(own)
    acted[..., 2] = own[..., 2]
    maps = user_maps(persona, recogniser, user) if means in MAPPED else {}
    labels, used, chosen, keys = {}, {}, {}, {}
    for part in PARTS:
        even, there = own / np.append(face_scale(here, part), 1.0), face_scale(persona.fapu, part)
        classes, style = recogniser.components[part].classes, persona.parts[part]
        labels[part] = seen.labels[part].names(classes)
        if means in MAPPED:
            chosen[part] = np.full(len(seen.rows), -1)
            keys[part] = np.ones(len(seen.rows), dtype=bool)
            used[part] = labels[part]
            flat = flatten(even[:, part_vertices(part), :2])
            moved = maps[part](flat)
            if means == "motion" and style.motion is not None:
                usual = None if user is None else user.parts[part].motion
                moved = restyle(
                    part, flat, moved, seen.labels[part].first, seen.rows, float(face.rate),
                    style.motion, style.reach(there), usual,
                )  # fmt: skip
            acted[:, part_vertices(part), :2] = there * unflatten(moved)
            continue
        chosen[part] = choose_masks(style, part, even, there, seen.labels[part], classes)
        used[part] = [style.labels[mask] if mask >= 0 else "" for mask in chosen[part].tolist()]
        keys[part] = find_keys(chosen[part])
        acted[:, part_vertices(part)] = bridge(style, chosen[part], keys[part], seen.rows)
    if means == "motion":
        keep_shut(acted, own, persona.neutral, seen.neutral)
    return Performance(seen.rows, own, acted, labels, used, chosen, keys)


def usable_means(persona: Persona, means: Means) -> Means:
    """Return these means, or "curves", with a warning, where the Persona lacks statistics of motion.

    Raises OptionError for unknown means.
    """
    if means not in MEANS:
        raise OptionError(
            f"means must be one of {', '.join(MEANS)}, not {means!r}{did_you_mean(means, MEANS)}"
        )
    if means != "motion" or persona.motions is not None:
        return means
    warn(
        f"the Persona of {persona.name or 'the actor'} has no statistics of motion, as its file is of "
        "version 1: amplitude, speed and sides stay the user's; learn it again to have them",
        stacklevel=3,
    )
    return "curves"


def user_maps(
    persona: Persona, recogniser: ClassRecogniser, user: Persona | None = None
) -> dict[str, CurveMap]:
    """Return the maps from a user's displacements to the actor's, by part.

    user: the user's Persona; None for people in general.
    """
    general = general_curves(recogniser)
    curves = general if user is None else {part: user.parts[part].curves for part in PARTS}
    return {part: fit_curves(curves[part], persona.parts[part].curves) for part in PARTS}


def choose_masks(
    style: PartStyle, part: str, own: Float64, scale: Float64, labels: Labels, classes: tuple[str, ...]
) -> Intp:
    """Return the number of the mask that each frame shows, -1 for none: int (S,).

    It is the nearest mask of the user's class. own: (S, 86, 3), the user's displacements, for a standard
    face. scale: (2,), the actor's `face_scale`. Distances are between displaced standard masks, so that the
    shapes of the faces have no effect. Where the actor has no mask of a class of two, the first class counts.
    """
    rows = part_points(part)
    standard = standard_mask()[rows, :2]
    masks = standard + style.moved[:, : len(rows), :2] / scale
    users = standard + own[:, rows, :2]
    chosen = np.full(len(own), -1, dtype=np.intp)
    names = np.array(labels.names(classes), dtype=object)
    for name in set(names.tolist()) - {""}:
        candidates = style.rows.get(name)
        if candidates is None:
            candidates = style.rows.get(name.partition("/")[0])
        if candidates is not None:
            frames = np.flatnonzero(names == name)
            chosen[frames] = _nearest(users[frames], masks, candidates)
    return chosen


def _nearest(users: Float64, masks: Float64, candidates: Intp) -> Intp:
    """Return the number of the nearest candidate among masks (M, K, 2) for each of (S, K, 2)."""
    result = np.zeros(len(users), dtype=np.intp)
    for first in range(0, len(users), BLOCK):
        distances = mask_distance(users[first : first + BLOCK, None], masks[candidates][None])
        result[first : first + BLOCK] = candidates[distances.argmin(axis=1)]
    return result


def find_keys(chosen: Intp) -> Bool:
    """Return which frames (S,) are keys: near both ends of each run of a mask, so that runs blend."""
    keys = np.zeros(len(chosen), dtype=bool)
    edges = np.flatnonzero(np.diff(chosen)) + 1
    for start, stop in zip([0, *edges.tolist()], [*edges.tolist(), len(chosen)], strict=True):
        if start < stop and chosen[start] >= 0:
            inset = min(KEY_INSET, (stop - start - 1) // 2)
            keys[[start + inset, stop - 1 - inset]] = True
    shown = np.flatnonzero(chosen >= 0)
    if len(shown):
        keys[[shown[0], shown[-1]]] = True
    return keys


def bridge(style: PartStyle, chosen: Intp, keys: Bool, frames: Intp) -> Float64:
    """Return displacements (S, V, 3) of a part: linear between the masks at keys; 0 without keys."""
    width = style.moved.shape[1:]
    at = np.flatnonzero(keys)
    if not len(at):
        return np.zeros((len(chosen), *width))
    values = style.moved[chosen[at]].reshape(len(at), -1)
    place = np.clip(np.searchsorted(frames[at], frames, side="right") - 1, 0, max(len(at) - 2, 0))
    after = np.minimum(place + 1, len(at) - 1)
    span = np.maximum(frames[at[after]] - frames[at[place]], 1)
    share = np.clip((frames - frames[at[place]]) / span, 0, 1)[:, None]
    return np.asarray((values[place] * (1 - share) + values[after] * share).reshape(len(chosen), *width))


def animate_as(
    face: TrackedFace,
    persona: Persona | None,
    *,
    means: Means = DEFAULT_MEANS,
    neutral: Neutral = None,
    user: Persona | None = None,
    head: bool = True,
    recogniser: ClassRecogniser | None = None,
) -> Animation:
    """Return a user's performance in an actor's style, as FAPs that move any face.

    persona: None for the user's own style. head: whether the user's head turns, too. Other options and errors
    as for `transfer`. Frames in which the user is not seen are interpolated; before the first and after the
    last that is seen, the face stays still.
    """
    recogniser = ClassRecogniser.default() if recogniser is None else recogniser
    if persona is None:
        seen = observe(face, recogniser, neutral)
        rows, values = seen.rows, own_faps(seen, recogniser)
    else:
        performance = transfer(face, persona, means=means, neutral=neutral, user=user, recogniser=recogniser)
        rows, values = performance.rows, mask_faps(performance.acted, persona.fapu, recogniser.jaw)
    return make_animation(face, rows, values, head=head, name=face.name)


def own_faps(seen: Observation, recogniser: ClassRecogniser) -> Float64:
    """Return the FAPs (S, 68) of a face in its own style."""
    return mask_faps(seen.mask_motion(recogniser), measure_fapu(seen.neutral), recogniser.jaw)


def make_animation(face: TrackedFace, rows: Intp, values: Float64, *, head: bool, name: str) -> Animation:
    """Return the animation of all frames of a recording from the FAPs (S, 68) of the frames `rows`."""
    numbers = [*shown_numbers(), *(HEAD if head else ())]
    values = values.copy()
    if head:
        values[:, [fap - 1 for fap in HEAD]] = face.angles[rows] / 1e-5
    times = face.times - face.times[0]
    count = int(times[-1] * float(face.rate) + 1e-6) + 1
    at = np.arange(count) / float(face.rate)
    track, mask = np.zeros((count, FAP_COUNT), dtype=np.int32), np.zeros((count, FAP_COUNT), dtype=bool)
    for number in numbers:
        track[:, number - 1] = np.rint(np.interp(at, times[rows], values[:, number - 1]))
        mask[:, number - 1] = True
    return Animation(face.rate, np.arange(count), FaceTrack(track, mask), None, name)
