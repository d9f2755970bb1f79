"""FAPs in glTF files of this project: described in a note, and computed again from the animation.

The note names the morph targets and joints that show each FAP. FAPs that the motion does not determine (the
file has no face, the model has no table for them, an eye turns by more than 180 degrees) are stored as
numbers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fba.animation import FaceTrack
from fba.arrays import Bool, Float32, Float64
from fba.errors import warn
from fba.face import FaceModel, resolve
from fba.formats.gltf._fap_joints import FapJoint
from fba.formats.gltf._morph_targets import Targets
from fba.formats.gltf._pose import Sampler, nearest_rotation, sample
from fba.gltf import Builder, Clip, Gltf, Value
from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP

MAX_ERROR = 0.25
"""Largest error, in steps, of a FAP computed from motion, so that rounding gives the exact value."""
MAX_FAP = 2.0**31
"""FAP values are smaller."""
MOST_TARGETS = 1 << 12
LOW_LEVEL = slice(FIRST_LOW_LEVEL_FAP - 1, FAP_COUNT)


def face_note(
    builder: Builder,
    track: FaceTrack,
    shown: Float32,
    model: FaceModel,
    targets: Sequence[Targets] = (),
    joints: Sequence[tuple[FapJoint, Mapping[int, Float64]]] = (),
) -> dict[str, Any]:
    """Return the note that `read_face` reads.

    shown: float32 (T, 68), FAPs as `resolve` returns them for track and model. targets: all in the file.
    joints: that FAPs move, with the FAPs (T,) that follow from their motion.
    """
    covered: set[int] = set()
    names: dict[str, list[float]] = {}
    for group in targets:
        fap = group.fap
        if _close(group.weights.astype(np.float64) @ np.array(group.values), shown[:, fap - 1]):
            covered.add(fap)
            names |= {name: [fap, value] for name, value in zip(group.names, group.values, strict=True)}
    joint_notes = []
    for joint, values_of in joints:
        right = {fap for fap, values in values_of.items() if _close(values, shown[:, fap - 1])}
        if right - covered:
            joint_notes.append(joint.to_note(right - covered))
            covered |= right
    rest = [fap for fap in range(FIRST_LOW_LEVEL_FAP, FAP_COUNT + 1) if fap not in covered]
    return {
        "sent": (np.flatnonzero(_sent(track, shown, model)) + 1).tolist(),
        "targets": names,
        "joints": joint_notes,
        "numbers": [[fap, builder.data(shown[:, fap - 1])] for fap in rest if shown[:, fap - 1].any()],
    }


def _close(values: Float64, shown: Float32) -> bool:
    """Whether values (T,) round to the shown values (T,)."""
    return bool(np.abs(values - shown).max(initial=0) < MAX_ERROR)


def _sent(track: FaceTrack, shown: Float32, model: FaceModel) -> Bool:
    """Return bool (68,): FAPs that show the same when sent in every frame; in doubt, all low-level FAPs."""
    sent: Bool = np.asarray(track.mask.any(axis=0) | shown.any(axis=0))
    sent[: FIRST_LOW_LEVEL_FAP - 1] = False
    values = np.rint(shown).astype(np.int64).clip(-(2**31), 2**31 - 1).astype(np.int32)
    again = resolve(FaceTrack(values, np.broadcast_to(sent, values.shape)), model)
    if np.abs(again - shown).max(initial=0) > 1:
        sent[LOW_LEVEL] = True
    return sent


def read_face(gltf: Gltf, clip: Clip, note: Value, times: Float64) -> FaceTrack:
    """Return the face track of an animation with such a note, at times (T,), seconds.

    Raises ModelError if the note is wrong. Warns (FbaWarning) of missing morph targets.
    """
    values = np.zeros((len(times), FAP_COUNT))
    missing: list[str] = []
    _add_targets(gltf, clip, note.member("targets"), times, values, missing)
    _read_joints(gltf, clip, note.member("joints"), times, values)
    for entry in note.member("numbers").elements(FAP_COUNT):
        pair = entry.elements(2)
        if len(pair) != 2:
            raise entry.error("expected a FAP and an accessor")
        values[:, _fap(pair[0]) - 1] = gltf.accessors.floats(pair[1], "SCALAR", count=len(times))[:, 0]
    if missing:
        warn(
            f"{gltf.file}: morph targets of FAPs are missing, and taken as 0: "
            f"{', '.join(missing[:5])}{', ...' if len(missing) > 5 else ''}",
            stacklevel=6,
        )
    values = np.rint(values)
    if values.size and not np.abs(values).max() < MAX_FAP:
        wrong = int(np.argwhere(~(np.abs(values) < MAX_FAP))[0, 1]) + 1
        raise note.error(f"the animation gives FAP {wrong} values that do not fit 32 bits")
    sent = np.zeros(FAP_COUNT, dtype=bool)
    sent[[_fap(entry) - 1 for entry in note.member("sent").elements(FAP_COUNT)]] = True
    return FaceTrack(values.astype(np.int32), np.broadcast_to(sent, values.shape))


def _fap(value: Value) -> int:
    return value.integer(FIRST_LOW_LEVEL_FAP, FAP_COUNT)


def _add_targets(
    gltf: Gltf, clip: Clip, note: Value, times: Float64, values: Float64, missing: list[str]
) -> None:
    """Add the FAPs of morph targets to values (T, 68); append the names of missing targets to `missing`."""
    wanted: dict[str, tuple[int, float]] = {}
    for name, entry in note.members():
        pair = entry.elements(2)
        if len(pair) != 2 or len(wanted) >= MOST_TARGETS:
            raise entry.error("expected a FAP and its value at weight 1")
        wanted[name] = _fap(pair[0]), pair[1].number(-MAX_FAP, MAX_FAP)
    channels = {channel.node: channel for channel in clip.channels if channel.path == "weights"}
    seen: set[int] = set()
    for number, node in enumerate(gltf.nodes):
        if node.mesh is None or node.mesh in seen:
            continue
        seen.add(node.mesh)  # the first node that shows a mesh counts
        mesh = gltf.meshes[node.mesh]
        columns = [column for column, name in enumerate(mesh.morph_names) if name in wanted]
        if not columns:
            continue
        weights = np.array(mesh.weights)[None] if number not in channels else sample(channels[number], times)
        for column in columns:
            fap, value = wanted.pop(mesh.morph_names[column], (0, 0.0))
            if fap:  # the first of several targets with equal names counts
                values[:, fap - 1] += weights[:, column] * value
    missing += wanted


def _read_joints(gltf: Gltf, clip: Clip, note: Value, times: Float64, values: Float64) -> None:
    """Set the columns of values (T, 68) that joints show."""
    entries = note.elements(FAP_COUNT)
    if not entries:
        return
    sampler = Sampler(gltf, clip.channels, times)
    for entry in entries:
        joint = FapJoint.from_note(entry, len(gltf.nodes))
        turned = nearest_rotation(sampler.linear(joint.node))
        shown = joint.values(turned, sampler.translation(joint.node))
        for fap in joint.read_faps:
            values[:, fap - 1] = shown[fap]
