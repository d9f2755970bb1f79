"""Read glTF files of this project, whose joints are those of BAPs and need no retargeting.

FAPs come from morph targets and joints (`fba.formats.gltf._fap_tracks`).
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import cast

import numpy as np

from fba.animation import Animation, BodyTrack
from fba.arrays import Float64
from fba.body import BapSolver, Skeleton, convention_names
from fba.body.solve.solver import solve_track
from fba.choices import Axes
from fba.errors import FormatError
from fba.formats.gltf._fap_joints import MAX_COORDINATE
from fba.formats.gltf._fap_tracks import read_face
from fba.formats.gltf._pose import Sampler, key_times, nearest_rotation
from fba.formats.gltf._writer import MARK, MOST_FRAMES
from fba.formats.text.frame_rates import parse_rate
from fba.gltf import Channel, Clip, Gltf, Value, optional_member

VERSION = 1
"""Version of the note."""
MAX_INDEX = 1 << 62
"""Largest frame number."""


def find_note(gltf: Gltf, clip: Clip) -> Value | None:
    """Return the note that fba adds to an animation (rate, first frame, body, face); None in other files."""
    entries = gltf.document.elements(1 << 18, "animations")
    entry = entries[gltf.animations.index(clip)]
    extras = entry.get("extras")
    note = optional_member(extras, MARK) if extras is not None and isinstance(extras.data, dict) else None
    ours = note is not None and isinstance(note.data, dict) and ("root" in note.data or "face" in note.data)
    return note if ours else None


def read_note(gltf: Gltf, clip: Clip, note: Value) -> Animation:
    """Return the tracks of an animation with such a note.

    Raises ModelError if the note is wrong; warns (FbaWarning) of morph targets that are missing.
    """
    if note.member("version").integer(0, 1 << 30) != VERSION:
        raise note.error(
            f"has version {note.member('version').data}, but this fba reads version {VERSION} only"
        )
    text = note.member("rate")
    try:
        rate: Fraction = parse_rate(text.text(100))
    except FormatError as error:
        raise text.error(str(error)) from None
    first = note.member("first").integer(-MAX_INDEX, MAX_INDEX)
    nodes: dict[str, int] = {}
    channels: Sequence[Channel] = clip.channels
    if note.get("root") is not None:
        nodes = _find_joints(gltf, note.member("root").index(len(gltf.nodes), "node"), Skeleton.default())
        inside = set(nodes.values())
        channels = [channel for channel in clip.channels if channel.node in inside]
    times = key_times(channels)
    if len(times) > MOST_FRAMES:
        raise note.error(f"its animation has {len(times)} keys, more than the {MOST_FRAMES} that can be read")
    steps = np.rint(times * float(rate))
    if not (steps[-1] < MAX_INDEX and (len(steps) < 2 or (np.diff(steps) > 0).all())):
        raise text.error("some keys of the animation are less than a frame apart at this rate")
    body = _body(gltf, channels, note, nodes, times) if nodes else None
    face = read_face(gltf, clip, face_note, times) if (face_note := note.get("face")) is not None else None
    return Animation(rate, first + steps.astype(np.int64), face, body, clip.name)


def _body(
    gltf: Gltf, channels: Sequence[Channel], note: Value, nodes: dict[str, int], times: Float64
) -> BodyTrack:
    """Return the body track at times (T,). nodes: joint of the standard -> node."""
    axes = cast("Axes", note.member("axes").choice(*convention_names()))
    centre = np.array(note.member("centre").numbers(3, -MAX_COORDINATE, MAX_COORDINATE))
    standard = Skeleton.default()

    def matrices(rows: slice) -> Float64:
        return _matrices(Sampler(gltf, channels, times[rows]), nodes, standard, centre)

    return solve_track(BapSolver(standard, axes), nodes, len(times), matrices)


def _find_joints(gltf: Gltf, root: int, standard: Skeleton) -> dict[str, int]:
    """Return the nodes at and below the root that are joints of the standard, by name."""
    nodes = {standard.names[0]: root}
    below = {root}
    for number in gltf.order:
        parent = gltf.nodes[number].parent
        if parent in below:
            below.add(number)
            if gltf.nodes[number].name in standard:
                nodes.setdefault(gltf.nodes[number].name, number)
    return nodes


def _matrices(sampler: Sampler, nodes: dict[str, int], standard: Skeleton, centre: Float64) -> Float64:
    """Return (T, J, 4, 4) of the standard's joints: world rotations, and the root's position.

    centre: (3,), position of the root at rest in the file.
    """
    shift = sampler.translation(nodes[standard.names[0]])
    result = np.zeros((len(shift), len(standard), 4, 4))
    result[:, :, 3, 3] = 1.0
    for joint, name in enumerate(standard.names):
        parent = int(standard.parents[joint])
        above = np.eye(3) if parent < 0 else result[:, parent, :3, :3]
        turned = nearest_rotation(sampler.linear(nodes[name])) if name in nodes else np.eye(3)
        result[:, joint, :3, :3] = above @ turned
    result[:, 0, :3, 3] = shift - centre + standard.centres[0]
    return result
