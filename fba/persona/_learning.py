"""Learning of a Persona from recordings of an actor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fba.arrays import Float64
from fba.errors import ModelError, OptionError, warn
from fba.persona._curves import measure_curves
from fba.persona._observation import Neutral, Observation, observe
from fba.persona._persona import SHARE_OF_WIDTH, PartStyle, Persona, part_width
from fba.persona.motion import Tally, flatten
from fba.persona.points import TrackedFace, mask_distance
from fba.persona.points.layout import PARTS, part_points, part_vertices
from fba.persona.recognition import ClassRecogniser, Labels
from fba.persona.recognition._faps import face_scale, measure_fapu

MIN_MOTION = 1.5
"""Mean displacement of a part's points, millimetres, that noise and a turning head do not reach."""
MAX_MASKS = 500
"""Largest number of masks of a class."""


def learn(
    faces: Sequence[TrackedFace],
    name: str = "",
    *,
    neutral: Sequence[Neutral] | None = None,
    warm_up: int = 0,
    recogniser: ClassRecogniser | None = None,
) -> Persona:
    """Return the Persona of an actor, from one or several recordings.

    neutral: for each recording, the frames of the neutral face; see `observe`. By default the first second of
    each. warm_up: number of frames left out at the start of each. recogniser: None for the default.

    Raises ModelError where a recording cannot be used, or the face rests throughout; OptionError. Warns of
    frames that are left out.
    """
    if not faces:
        raise OptionError("there is no recording to learn from")
    rests = [None] * len(faces) if neutral is None else list(neutral)
    if len(rests) != len(faces):
        raise OptionError(f"{len(faces)} recordings have {len(rests)} neutral faces")
    recogniser = ClassRecogniser.default() if recogniser is None else recogniser
    takes = [
        observe(face, recogniser, rest, warm_up=warm_up) for face, rest in zip(faces, rests, strict=True)
    ]
    still = np.asarray(np.mean([take.neutral for take in takes], axis=0))
    moved = np.concatenate([take.mask_motion(recogniser) for take in takes])
    rates = [float(face.rate) for face in faces]
    parts = {part: _learn_part(part, takes, rates, moved, still, recogniser) for part in PARTS}
    if not _moves(moved):
        raise ModelError("the actor's face rests in all frames: there is no expression to learn")
    frames, turned = sum(map(len, faces)), sum(int(take.registered.turned.sum()) for take in takes)
    lost = sum(int((~face.tracked).sum()) for face in faces)
    if turned or lost:
        warn(
            f"of {frames} frames, {lost} have no face, and in {turned} the head is turned by more than "
            "30 degrees: they are left out",
            stacklevel=2,
        )
    return Persona(name or faces[0].name, still, parts, frames, len(moved), turned, lost)


def _moves(moved: Float64) -> bool:
    """Return whether any part moves by more than noise and a turning head. moved: (S, 86, 3)."""
    for part in PARTS:
        far = np.linalg.norm(moved[:, part_vertices(part), :2], axis=2).mean(axis=1)
        if np.percentile(far, 99) > MIN_MOTION:
            return True
    return False


def _learn_part(
    part: str,
    takes: list[Observation],
    rates: list[float],
    moved: Float64,
    still: Float64,
    recogniser: ClassRecogniser,
) -> PartStyle:
    """Return the actor's style of a part. moved: (S, 86, 3), in all frames that are used."""
    component = recogniser.components[part]
    source = np.concatenate([np.full(len(take.rows), n) for n, take in enumerate(takes)])
    frame = np.concatenate([take.rows for take in takes])
    labels = Labels(
        np.concatenate([take.labels[part].first for take in takes]),
        np.concatenate([take.labels[part].second for take in takes]),
    )
    names = labels.names(component.classes)
    masks = moved[:, part_vertices(part)]
    rows = prune(masks[:, : len(part_points(part)), :2], names, SHARE_OF_WIDTH * part_width(still, part))
    even = masks[..., :2] / face_scale(measure_fapu(still), part)
    flat = flatten(even)
    tally = Tally(len(component.classes), flat.shape[1])
    for number, rate in enumerate(rates):
        take = source == number
        tally.add(flat[take], labels.first[take], frame[take], rate)
    return PartStyle(
        tuple(names[row] for row in rows), masks[rows], source[rows], frame[rows],
        measure_curves(flat, labels, len(component.classes)), tally.motion(),
    )  # fmt: skip


def prune(masks: Float64, names: list[str], least: float) -> list[int]:
    """Return the rows of masks (S, K, D) that are `least` or more from all masks kept before in their class.

    names: the class of each; masks without one ("") are left out.
    """
    kept: list[int] = []
    classes: dict[str, list[int]] = {}
    for row, name in enumerate(names):
        if name:
            classes.setdefault(name, []).append(row)
    for rows in classes.values():
        chosen: list[int] = []
        for row in rows:
            if len(chosen) >= MAX_MASKS:
                break
            if not chosen or float(mask_distance(masks[row][None], masks[chosen]).min()) >= least:
                chosen.append(row)
        kept += chosen
    return sorted(kept)
