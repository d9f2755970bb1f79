"""FAPs in glTF files of this project: noted beside the animation, and worked out again from its motion.

The note says which morph targets and joints show which FAP. FAPs that no motion tells (no face is in the
file, the model does nothing for them, an eye is turned by more than half a circle) lie beside it as numbers.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fba.animation import FaceTrack
from fba.arrays import Bool, Float32, Float64
from fba.errors import FbaWarning
from fba.face.model import FaceModel
from fba.face.resolve import resolve
from fba.formats.gltf._fap_joints import FapJoint
from fba.formats.gltf._morph_targets import Targets
from fba.formats.gltf._pose import Sampler, nearest_rotation, sample
from fba.gltf import Animation as Clip
from fba.gltf import Gltf
from fba.gltf.values import Value
from fba.gltf.writer import Builder
from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP

CLOSE = 0.25
"""Steps by which a FAP, told by motion, may miss the one shown, to be rounded to the same."""
LARGEST = 2.0**31
MOST_TARGETS = 1 << 12
LOW = slice(FIRST_LOW_LEVEL_FAP - 1, FAP_COUNT)


def face_note(
    builder: Builder,
    track: FaceTrack,
    shown: Float32,
    model: FaceModel,
    targets: Sequence[Targets] = (),
    joints: Sequence[tuple[FapJoint, Mapping[int, Float64]]] = (),
) -> dict[str, Any]:
    """What `read_face` needs. shown: float32 (T, 68), as `resolve` gives the track for the model.

    targets: all that are in the file. joints: those that FAPs turn, with the FAPs (T,) that their motion
    tells.
    """
    told: set[int] = set()
    names: dict[str, list[float]] = {}
    for found in targets:
        values = found.weights.astype(np.float64) @ np.array(found.values)
        if _close(values, shown[:, found.fap - 1]):
            told.add(found.fap)
            names |= {name: [found.fap, value] for name, value in zip(found.names, found.values, strict=True)}
    kept = []
    for joint, values_of in joints:
        right = {fap for fap, values in values_of.items() if _close(values, shown[:, fap - 1])}
        if right - told:
            kept.append(joint.note(right - told))
            told |= right
    rest = [fap for fap in range(FIRST_LOW_LEVEL_FAP, FAP_COUNT + 1) if fap not in told]
    return {
        "sent": (np.flatnonzero(_sent(track, shown, model)) + 1).tolist(),
        "targets": names,
        "joints": kept,
        "numbers": [[fap, builder.data(shown[:, fap - 1])] for fap in rest if shown[:, fap - 1].any()],
    }


def _close(values: Float64, shown: Float32) -> bool:
    return bool(np.abs(values - shown).max(initial=0) < CLOSE)


def _sent(track: FaceTrack, shown: Float32, model: FaceModel) -> Bool:
    """bool (68,): the FAPs whose values, sent from the first frame on, show the same; all where in doubt."""
    sent: Bool = np.asarray(track.mask.any(axis=0) | shown.any(axis=0))
    sent[: FIRST_LOW_LEVEL_FAP - 1] = False
    values = np.rint(shown).astype(np.int64).clip(-(2**31), 2**31 - 1).astype(np.int32)
    again = resolve(FaceTrack(values, np.broadcast_to(sent, values.shape)), model)
    if np.abs(again - shown).max(initial=0) > 1:
        sent[LOW] = True
    return sent


def read_face(gltf: Gltf, clip: Clip, note: Value, times: Float64) -> FaceTrack:
    """The face track of an animation with such a note, at times (T,), seconds. Raises ModelError where it
    lies; warns (FbaWarning) where something that it names is not there any more."""
    values = np.zeros((len(times), FAP_COUNT))
    lost: list[str] = []
    _from_targets(gltf, clip, note.member("targets"), times, values, lost)
    _from_joints(gltf, clip, note.member("joints"), times, values)
    for entry in note.member("numbers").elements(FAP_COUNT):
        pair = entry.elements(2)
        if len(pair) != 2:
            raise entry.error("expected a FAP and an accessor")
        values[:, _fap(pair[0]) - 1] = gltf.accessors.floats(pair[1], "SCALAR", count=len(times))[:, 0]
    if lost:
        warnings.warn(
            f"{gltf.file}: morph targets of FAPs are missing, and count as 0: "
            f"{', '.join(lost[:5])}{', ...' if len(lost) > 5 else ''}",
            FbaWarning,
            stacklevel=6,
        )
    values = np.rint(values)
    if values.size and not np.abs(values).max() < LARGEST:
        wrong = int(np.argwhere(~(np.abs(values) < LARGEST))[0, 1]) + 1
        raise note.error(f"the animation gives FAP {wrong} values that do not fit 32 bits")
    sent = np.zeros(FAP_COUNT, dtype=bool)
    sent[[_fap(entry) - 1 for entry in note.member("sent").elements(FAP_COUNT)]] = True
    return FaceTrack(values.astype(np.int32), np.broadcast_to(sent, values.shape))


def _fap(value: Value) -> int:
    return value.integer(FIRST_LOW_LEVEL_FAP, FAP_COUNT)


def _from_targets(
    gltf: Gltf, clip: Clip, note: Value, times: Float64, values: Float64, lost: list[str]
) -> None:
    wanted: dict[str, tuple[int, float]] = {}
    for name, entry in note.members():
        pair = entry.elements(2)
        if len(pair) != 2 or len(wanted) >= MOST_TARGETS:
            raise entry.error("expected a FAP and its value at weight 1")
        wanted[name] = _fap(pair[0]), pair[1].number(-LARGEST, LARGEST)
    channels = {channel.node: channel for channel in clip.channels if channel.path == "weights"}
    for number, node in enumerate(gltf.nodes):
        if node.mesh is None:
            continue
        mesh = gltf.meshes[node.mesh]
        columns = [column for column, name in enumerate(mesh.morph_names) if name in wanted]
        if not columns:
            continue
        weights = np.array(mesh.weights)[None] if number not in channels else sample(channels[number], times)
        for column in columns:
            fap, value = wanted.pop(mesh.morph_names[column], (0, 0.0))
            if fap:  # else it has several targets of one name
                values[:, fap - 1] += weights[:, column] * value
    lost += wanted


def _from_joints(gltf: Gltf, clip: Clip, note: Value, times: Float64, values: Float64) -> None:
    entries = note.elements(FAP_COUNT)
    if not entries:
        return
    sampler = Sampler(gltf, clip.channels, times)
    for entry in entries:
        joint = FapJoint.of_note(entry, len(gltf.nodes))
        turned = nearest_rotation(sampler.linear(joint.node))
        shown = joint.values(turned, sampler.translation(joint.node))
        for fap in joint.told:
            values[:, fap - 1] = shown[fap]
