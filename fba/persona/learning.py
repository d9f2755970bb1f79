"""Learns a Persona from recordings of an actor."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from fba.arrays import Float64, Intp
from fba.errors import FbaWarning, ModelError, OptionError
from fba.persona.curves import measure_curves
from fba.persona.motion import Tally, flatten
from fba.persona.observation import Neutral, Observation, observe
from fba.persona.persona import SHARE_OF_WIDTH, PartStyle, Persona, part_width
from fba.persona.points import TrackedFace
from fba.persona.points.distances import mask_distance
from fba.persona.points.layout import PARTS, part_points, part_vertices
from fba.persona.recognition import ClassRecogniser, Labels
from fba.persona.recognition.faps import face_scale, measure_fapu

REST = 1.5
"""Millimetres by which the points of a part that rests are off, in the mean: noise, and a turning head."""
MOST_MASKS = 500
"""Masks that a class of a part has at most."""


def learn(
    faces: Sequence[TrackedFace],
    name: str = "",
    *,
    neutral: Sequence[Neutral] | None = None,
    warm_up: int = 0,
    recogniser: ClassRecogniser | None = None,
) -> Persona:
    """Return the Persona of an actor, from one or several recordings.

    neutral: for each recording, which frames show the neutral face; see `observe`. None: the first second
    of each. warm_up: frames at the start of each that are left out. recogniser: None for the default.

    Raises ModelError where a recording cannot be used, or nothing but a face at rest is seen; OptionError.
    Warns of frames that are left out.
    """
    if not faces:
        raise OptionError("there is no recording to learn from")
    rests = [None] * len(faces) if neutral is None else list(neutral)
    if len(rests) != len(faces):
        raise OptionError(f"{len(faces)} recordings have {len(rests)} neutral faces")
    known = ClassRecogniser.default() if recogniser is None else recogniser
    seen = [observe(face, known, rest, warm_up=warm_up) for face, rest in zip(faces, rests, strict=True)]
    still = np.asarray(np.mean([one.neutral for one in seen], axis=0))
    moved = np.concatenate([one.mask_motion(known) for one in seen])
    source = np.concatenate([np.full(len(one.rows), n) for n, one in enumerate(seen)])
    frame = np.concatenate([one.rows for one in seen])
    rates = [float(face.rate) for face in faces]
    parts = {part: _learn_part(part, seen, rates, moved, source, frame, still, known) for part in PARTS}
    if not _moves(moved):
        raise ModelError("the actor's face rests in all frames: there is no expression to learn")
    frames, turned = sum(map(len, faces)), sum(int(one.registered.turned.sum()) for one in seen)
    lost = sum(int((~face.tracked).sum()) for face in faces)
    if turned or lost:
        warnings.warn(
            f"of {frames} frames, {lost} have no face, and in {turned} the head is turned by more than "
            "30 degrees: they are left out", FbaWarning, stacklevel=2,
        )  # fmt: skip
    return Persona(name or faces[0].name, still, parts, frames, len(frame), turned, lost)


def _moves(moved: Float64) -> bool:
    """Return whether a part ever moves by more than noise and a turning head do. moved: (S, 86, 3)."""
    for part in PARTS:
        far = np.linalg.norm(moved[:, part_vertices(part), :2], axis=2).mean(axis=1)
        if np.percentile(far, 99) > REST:
            return True
    return False


def _learn_part(
    part: str,
    seen: list[Observation],
    rates: list[float],
    moved: Float64,
    source: Intp,
    frame: Intp,
    still: Float64,
    known: ClassRecogniser,
) -> PartStyle:
    """Return what the actor does with a part. moved: (S, 86, 3), of all frames that are used."""
    component = known.components[part]
    labels = Labels(
        np.concatenate([one.labels[part].first for one in seen]),
        np.concatenate([one.labels[part].second for one in seen]),
    )
    names = labels.names(component.classes)
    vertices, points = part_vertices(part), len(part_points(part))
    own = moved[:, vertices]
    rows = prune(own[:, :points, :2], names, SHARE_OF_WIDTH * part_width(still, part))
    even = own[..., :2] / face_scale(measure_fapu(still), part)
    flat = flatten(even)
    tally = Tally(len(component.classes), flat.shape[1])
    for number, rate in enumerate(rates):
        take = source == number
        tally.add(flat[take], labels.first[take], frame[take], rate)
    return PartStyle(
        tuple(names[row] for row in rows), own[rows], source[rows], frame[rows],
        measure_curves(flat, labels, len(component.classes)), tally.motion(),
    )  # fmt: skip


def prune(masks: Float64, names: list[str], least: float) -> list[int]:
    """Return rows of masks (S, K, D) that are kept: of a class, none is nearer than `least` to one before it.

    names: the class of each, "" for none, whose masks are left out.
    """
    kept: list[int] = []
    classes: dict[str, list[int]] = {}
    for row, name in enumerate(names):
        if name:
            classes.setdefault(name, []).append(row)
    for rows in classes.values():
        chosen: list[int] = []
        for row in rows:
            if len(chosen) >= MOST_MASKS:
                break
            if not chosen or float(mask_distance(masks[row][None], masks[chosen]).min()) >= least:
                chosen.append(row)
        kept += chosen
    return sorted(kept)
