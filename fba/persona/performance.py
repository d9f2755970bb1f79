"""A user's performance in an actor's way: which mask each part shows in each frame, and the FAPs that this
gives."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Float64, Intp
from fba.choices import Means
from fba.errors import FbaWarning, OptionError, did_you_mean
from fba.parameters import FAP_COUNT
from fba.persona._restyle import keep_shut, restyle
from fba.persona.curves import CurveMap, fit_curves, general_curves
from fba.persona.motion import flatten, unflatten
from fba.persona.observation import Neutral, Observation, observe
from fba.persona.persona import MEANS, PartStyle, Persona
from fba.persona.points import TrackedFace
from fba.persona.points.distances import mask_distance
from fba.persona.points.layout import PARTS, part_points, part_vertices, standard_mask
from fba.persona.recognition import ClassRecogniser, Labels
from fba.persona.recognition.faps import face_scale, mask_faps, measure_fapu, told_numbers
from fba.tracks import FaceTrack

HEAD = (48, 49, 50)
"""FAPs of the head's turns: the user's own."""
EASE = 2
"""Frames before the end and after the start of a mask, at which it is a key: between keys, masks flow into
each other."""
BLOCK = 256
"""Frames whose distances from masks are computed at once."""
DEFAULT_MEANS: Means = "motion"
MAPPED = ("motion", "curves")
"""Means that need no masks: every frame is a key."""


@dataclass(frozen=True, eq=False)
class Performance:
    """A user's performance in an actor's way.

    rows: int (S,), the frames in which the user is seen. own, acted: float64 (S, 86, 3), millimetres that
    vertices move from the neutral mask, of the user's own and of the actor's. labels: part -> what the user
    does. used: part -> the label of the mask that is shown, "" without one. chosen: part -> int
    (S,), its number, -1 for none. keys: part -> bool (S,), frames that give values; those between are
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
        """Return (frame, part -> number of the mask) for frames in which a part has a key; frames may be
        missing."""
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
    """Return a user's performance in an actor's way.

    means: "motion" (the default), "curves", or "masks" (of the user's class, the nearest one: the source's
    way). neutral: the user's neutral frames, see `observe`. user: the user's own Persona, by which the user's
    usual way is known; None: it is that of people in general, and amplitude and speed are those of this
    performance. Raises ModelError, OptionError. Warns where a Persona has no statistics of motion: "curves"
    then take the place of "motion".
    """
    means = usable_means(persona, means)
    known = ClassRecogniser.default() if recogniser is None else recogniser
    seen = observe(face, known, neutral)
    own, here = seen.mask_motion(known), measure_fapu(seen.neutral)
    acted = np.zeros_like(own)
    acted[..., 2] = own[..., 2]
    maps = user_maps(persona, known, user) if means in MAPPED else {}
    labels, used, chosen, keys = {}, {}, {}, {}
    for part in PARTS:
        even, there = own / np.append(face_scale(here, part), 1.0), face_scale(persona.fapu, part)
        classes, style = known.components[part].classes, persona.parts[part]
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
        used[part] = [style.labels[one] if one >= 0 else "" for one in chosen[part].tolist()]
        keys[part] = find_keys(chosen[part])
        acted[:, part_vertices(part)] = bridge(style, chosen[part], keys[part], seen.rows)
    if means == "motion":
        keep_shut(acted, own, persona.neutral, seen.neutral)
    return Performance(seen.rows, own, acted, labels, used, chosen, keys)


def usable_means(persona: Persona, means: Means) -> Means:
    """Return the means that a Persona has what it takes for, and warn where they are others than asked for.

    Raises OptionError for means that do not exist.
    """
    if means not in MEANS:
        raise OptionError(
            f"means must be one of {', '.join(MEANS)}, not {means!r}{did_you_mean(means, MEANS)}"
        )
    if means != "motion" or persona.motions is not None:
        return means
    warnings.warn(
        f"the Persona of {persona.name or 'the actor'} has no statistics of motion, as its file is of "
        "version 1: amplitude, speed and sides stay the user's; learn it again to have them",
        FbaWarning, stacklevel=3,
    )  # fmt: skip
    return "curves"


def user_maps(
    persona: Persona, recogniser: ClassRecogniser, user: Persona | None = None
) -> dict[str, CurveMap]:
    """Return what makes the actor's displacements of each part of a user's.

    user: the user's own Persona; None for somebody who moves as people do in general.
    """
    general = general_curves(recogniser)
    return {
        part: fit_curves(
            general[part] if user is None else user.parts[part].curves, persona.parts[part].curves
        )
        for part in PARTS
    }


def choose_masks(
    style: PartStyle,
    part: str,
    own: Float64,
    scale: Float64,
    labels: Labels,
    classes: tuple[str, ...],
) -> Intp:
    """Return the number of the mask that each frame shows, -1 for none: int (S,).

    own: (S, 86, 3), how far the user's vertices have moved, for a standard face; scale: (2,), the actor's
    `face_scale`. Of the masks of the user's class, that with the
    smallest distance from the user's points (both moved from the standard mask, so that faces do not count,
    only how they move). Where the actor has none of a class of two, those of the first one; where none of
    this, no mask.
    """
    rows = part_points(part)
    standard = standard_mask()[rows, :2]
    masks = standard + style.moved[:, : len(rows), :2] / scale
    users = standard + own[:, rows, :2]
    chosen = np.full(len(own), -1, dtype=np.intp)
    names = np.array(labels.names(classes), dtype=object)
    for name in set(names.tolist()) - {""}:
        known = style.rows.get(name)
        if known is None:
            known = style.rows.get(name.partition("/")[0])
        if known is not None:
            frames = np.flatnonzero(names == name)
            chosen[frames] = _nearest(users[frames], masks, known)
    return chosen


def _nearest(users: Float64, masks: Float64, known: Intp) -> Intp:
    """Return the number of the nearest of some masks (M, K, 2) for each of the user's points (S, K, 2)."""
    result = np.zeros(len(users), dtype=np.intp)
    for first in range(0, len(users), BLOCK):
        some = users[first : first + BLOCK]
        result[first : first + BLOCK] = known[mask_distance(some[:, None], masks[known][None]).argmin(axis=1)]
    return result


def find_keys(chosen: Intp) -> Bool:
    """Return the frames (S,) that are keys: near both ends of each run of one mask, so that runs flow
    together."""
    keys = np.zeros(len(chosen), dtype=bool)
    edges = np.flatnonzero(np.diff(chosen)) + 1
    for start, stop in zip([0, *edges.tolist()], [*edges.tolist(), len(chosen)], strict=True):
        if start < stop and chosen[start] >= 0:
            inset = min(EASE, (stop - start - 1) // 2)
            keys[[start + inset, stop - 1 - inset]] = True
    if len(chosen):
        known = np.flatnonzero(chosen >= 0)
        if len(known):
            keys[[known[0], known[-1]]] = True
    return keys


def bridge(style: PartStyle, chosen: Intp, keys: Bool, frames: Intp) -> Float64:
    """Return displacements (S, V, 3) of a part: those of masks at keys, linear in between, at rest without
    any."""
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
    """Return a user's performance in an actor's way, as FAPs that move any face.

    persona: None for the user's own way. head: whether the user's head turns, too. Other options and errors
    as for `transfer`. Frames in which the user is not seen are interpolated; before and after, the face
    keeps still.
    """
    known = ClassRecogniser.default() if recogniser is None else recogniser
    if persona is None:
        seen = observe(face, known, neutral)
        rows, values = seen.rows, own_faps(seen, known)
    else:
        performance = transfer(face, persona, means=means, neutral=neutral, user=user, recogniser=known)
        rows, values = performance.rows, mask_faps(performance.acted, persona.fapu, known.jaw)
    return make_animation(face, rows, values, head=head, name=face.name)


def own_faps(seen: Observation, recogniser: ClassRecogniser) -> Float64:
    """Return the FAPs (S, 68) of a face that nobody's way is given to."""
    return mask_faps(seen.mask_motion(recogniser), measure_fapu(seen.neutral), recogniser.jaw)


def make_animation(face: TrackedFace, rows: Intp, values: Float64, *, head: bool, name: str) -> Animation:
    """Return FAPs (S, 68) of some frames as an animation of all, at the recording's rate."""
    numbers = [*told_numbers(), *(HEAD if head else ())]
    values = values.copy()
    if head:
        values[:, [one - 1 for one in HEAD]] = face.angles[rows] / 1e-5
    times = face.times - face.times[0]
    count = int(times[-1] * float(face.rate) + 1e-6) + 1
    at = np.arange(count) / float(face.rate)
    track, mask = np.zeros((count, FAP_COUNT), dtype=np.int32), np.zeros((count, FAP_COUNT), dtype=bool)
    for number in numbers:
        track[:, number - 1] = np.rint(np.interp(at, times[rows], values[:, number - 1]))
        mask[:, number - 1] = True
    return Animation(face.rate, np.arange(count), FaceTrack(track, mask), None, name)
