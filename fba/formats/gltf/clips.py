"""The clips (animations) of a glTF file: descriptions of all, and the choice of one."""

from __future__ import annotations

import warnings
from collections.abc import Collection
from dataclasses import dataclass

from fba.errors import FbaWarning, ModelError, Remedy, did_you_mean
from fba.gltf import Clip, Gltf

NAMED = 8
"""Most clips that a message names."""


@dataclass(frozen=True)
class ClipInfo:
    """A clip of a file.

    name: as in the file, or "animation 2". seconds: from the first key to the last. channels: count of the
    properties of nodes that it animates.
    """

    name: str
    seconds: float
    channels: int


def list_clips(gltf: Gltf) -> tuple[ClipInfo, ...]:
    """Return the clips of a glTF file, in its order."""
    clips = []
    for clip in gltf.animations:
        begins = [float(channel.times[0]) for channel in clip.channels if len(channel.times)]
        ends = [float(channel.times[-1]) for channel in clip.channels if len(channel.times)]
        seconds = max(ends, default=0.0) - min(begins, default=0.0)
        clips.append(ClipInfo(clip.name, seconds, len(clip.channels)))
    return tuple(clips)


def choose_clip(gltf: Gltf, clip: str | int | None, nodes: Collection[int]) -> Clip:
    """Return the clip with this name or number (from 0), or the first that turns one of the nodes.

    Capitals of a name do not matter if only one clip has it; a text that is no clip's name is a number.
    Raises ModelError if the clip does not exist. Warns (FbaWarning) if clip is None and there are several.
    """
    inside = set(nodes)
    if clip is None:
        moving = [
            a for a in gltf.animations if any(c.node in inside and c.path == "rotation" for c in a.channels)
        ]
        if not moving:
            raise ModelError(
                f"{gltf.file}: no animation turns the joints of the skeleton; there is no motion"
            )
        if len(moving) > 1:
            text = (
                f"{gltf.file}: has {len(moving)} animations, {_list_names(gltf)}; {moving[0].name!r} is read"
            )
            warnings.warn(
                FbaWarning(text).with_remedies(Remedy("clip", "choose with {}", repr(moving[1].name))),
                stacklevel=5,
            )
        return moving[0]
    match = _find_clip(gltf, clip)
    if match is None:
        hint = did_you_mean(str(clip), [a.name for a in gltf.animations])
        there = _list_names(gltf)
        raise ModelError(
            f"{gltf.file}: there is no animation {clip!r}{hint}; "
            f"{f'there are {there}' if there else 'the file has none'}"
        )
    if not any(channel.node in inside for channel in match.channels):
        raise ModelError(
            f"{gltf.file}: the animation {match.name!r} does not move the skeleton; "
            f"there are {_list_names(gltf)}"
        )
    return match


def _find_clip(gltf: Gltf, clip: str | int) -> Clip | None:
    """Return the clip with this name, else with this number; None if it does not exist."""
    clips = gltf.animations
    if isinstance(clip, str):
        for same in (
            [a for a in clips if a.name == clip],
            [a for a in clips if a.name.lower() == clip.lower()],
        ):
            if len(same) == 1:
                return same[0]
            if same:
                numbers = ", ".join(str(n) for n, a in enumerate(clips) if a in same)
                raise ModelError(
                    f"{gltf.file}: {len(same)} animations are called {clip!r}; give a number: {numbers}"
                ).with_remedies(Remedy("clip", "choose with {}", str(clips.index(same[0]))))
        if not clip.isdecimal():
            return None
        clip = int(clip[:9])
    return clips[clip] if 0 <= clip < len(clips) else None


def _list_names(gltf: Gltf) -> str:
    names = [repr(a.name) for a in gltf.animations]
    more = f", and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more
