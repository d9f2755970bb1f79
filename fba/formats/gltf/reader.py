"""glTF 2.0 skeletons: animated joints, as exporters write them from FBX, become BAPs.

A glTF skeleton rests in its bind pose, where every joint may stand turned; `SkeletonMotion` rests
with all rotations the identity. So rotations are taken against the bind pose, in the scene's frame.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from fractions import Fraction

import numpy as np

from fba import rotations
from fba.animation import Animation
from fba.arrays import Float64
from fba.capture import SkeletonMotion, from_skeleton, matching
from fba.capture.skeleton import MOST_FRAMES
from fba.errors import FbaWarning, FormatError, ModelError, Remedy
from fba.formats.gltf._own_files import note_of, read_note
from fba.formats.gltf._pose import BindPose, Sampler, key_times
from fba.gltf import Animation as Clip
from fba.gltf import Gltf, read_gltf
from fba.source import Path

USUAL_RATES = (24, 25, 30, 48, 50, 60, 90, 100, 120, 240)
DEFAULT_RATE = Fraction(30)
STRETCH = 0.01
"""Share of the skeleton's size by which a joint may move against its parent before it is worth a word."""


def sniff(head: bytes, suffix: str) -> bool:
    """Whether the first bytes of a file look like glTF, binary or JSON."""
    if head[:4] == b"glTF":
        return True
    return head.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"{" and (b'"asset"' in head or suffix == ".gltf")


def read(
    path: Path,
    *,
    rate: Fraction | int | str | None = None,
    scale: float | None = None,
    origin: str = "source",
    ground: str = "floor",
    plant: bool = True,
    spine: str | int = "spread",
    joints: Mapping[str, str] | None = None,
    clip: str | int | None = None,
) -> Animation:
    """A glTF skeleton's animation as BAPs (see `fba.capture.from_skeleton`, and `read_motion` for clip).

    Files that this project wrote are taken as they are, BAPs and FAPs with their own frames, unless they are
    to be retargeted by another option than clip and rate.

    Raises FormatError for anything that is not glTF, or whose skeleton is not a body; warns (FbaWarning)
    of what is left out.
    """
    try:
        gltf = read_gltf(path)
        plain = (joints, scale, origin, ground, plant, spine) == (
            None, None, "source", "floor", True, "spread",
        )  # fmt: skip
        if plain and gltf.animations:
            own = gltf.animations[0] if clip is None else _clip(gltf, clip, set(range(len(gltf.nodes))))
            note = note_of(gltf, own)
            if note is not None:
                animation = read_note(gltf, own, note)
                return animation if rate is None else animation.resample(Fraction(rate))
        motion = motion_of(gltf, clip=clip, rate=rate)
        return from_skeleton(
            motion, joints=joints, scale=scale, origin=origin, ground=ground, plant=plant, spine=spine
        )
    except ModelError as error:
        raise FormatError(error.finding, path=path).with_remedies(*error.remedies) from error


def read_motion(
    path: Path, *, clip: str | int | None = None, rate: Fraction | int | str | None = None
) -> SkeletonMotion:
    """The joints of a glTF file and one of its animations, sampled.

    clip: name or number (from 0) of the animation; the first that moves the skeleton where None. rate: frames
    a second; where None, that of the keys, if they are regular, else 30. Raises FormatError, ModelError;
    warns (FbaWarning) where there are several animations or skeletons to choose from.
    """
    return motion_of(read_gltf(path), clip=clip, rate=rate)


def motion_of(
    gltf: Gltf, *, clip: str | int | None = None, rate: Fraction | int | str | None = None
) -> SkeletonMotion:
    """As `read_motion`, of a file that has been read."""
    nodes = _skeleton(gltf)
    chosen = _clip(gltf, clip, set(nodes))
    channels = [channel for channel in chosen.channels if channel.node in set(nodes)]
    times = key_times(channels)
    frames = Fraction(rate) if rate is not None else _rate(times)
    if frames <= 0:
        raise ValueError(f"rate must be positive, not {rate}")
    first, last = float(times[0]), float(times[-1])
    count = int((last - first) * float(frames) + 1e-6) + 1
    if count > MOST_FRAMES:
        raise ModelError(
            f"animation {chosen.name!r}: {last - first:.0f} s at {float(frames):g} frames/s are "
            f"{count} frames, more than {MOST_FRAMES}; give a lower rate, or cut it into pieces"
        )
    at = first + np.arange(count) / float(frames)
    parents = [nodes.index(p) if (p := gltf.nodes[node].parent) in nodes else -1 for node in nodes]
    bind = BindPose(gltf, nodes, parents)
    sampler = Sampler(gltf, channels, at)

    # every node of the skeleton in the scene's frame, over time
    turned = np.zeros((count, len(nodes), 4))
    places = np.zeros((count, len(nodes), 3))
    linear: list[Float64] = []
    for number, node in enumerate(nodes):
        local = sampler.linear(node)
        parent = parents[number]
        shift = sampler.translation(node)
        if parent < 0:
            above = gltf.nodes[node].parent
            base = np.eye(4) if above is None else gltf.nodes[above].world
            linear.append(base[:3, :3] @ local)
            places[:, number] = shift @ base[:3, :3].T + base[:3, 3]
        else:
            linear.append(linear[parent] @ local)
            places[:, number] = places[:, parent] + (linear[parent] @ shift[:, :, None])[:, :, 0]
        turned[:, number] = bind.turned(number, linear[number])
    kept = _below(parents, _root([gltf.nodes[node].name for node in nodes]))
    local_turns = turned[:, kept]
    for place, number in enumerate(kept[1:], 1):
        back = turned[:, parents[number]] * [1, -1, -1, -1]
        local_turns[:, place] = rotations.multiply(back, turned[:, number])
    motion = SkeletonMotion(
        names=tuple(gltf.nodes[nodes[number]].name for number in kept),
        parents=np.array([kept.index(parents[n]) if place else -1 for place, n in enumerate(kept)]),
        offsets=bind.offsets()[kept],
        rotations=local_turns / np.linalg.norm(local_turns, axis=-1, keepdims=True),
        positions=places[:, kept[0]],
        rate=frames,
        name=chosen.name,
    )
    _say_stretched(motion, places[:, kept])
    return motion


def _skeleton(gltf: Gltf) -> list[int]:
    """Nodes of the skeleton, parents first, one root: joints of skins and what animates them, or all
    nodes."""
    wanted = {joint for skin in gltf.skins for joint in skin.joints}
    if not wanted:
        wanted = {channel.node for clip in gltf.animations for channel in clip.channels}
        wanted |= {number for number, node in enumerate(gltf.nodes) if node.parent in wanted}
    if not wanted:
        raise ModelError(
            f"{gltf.file}: has neither a skin with joints nor an animation; there is no skeleton"
        )
    for number in reversed(gltf.order):  # all joints hang together, up to where they meet
        parent = gltf.nodes[number].parent
        if number in wanted and parent is not None:
            wanted.add(parent)
    trees: dict[int, list[int]] = {}
    root_of: dict[int, int] = {}
    for number in gltf.order:
        if number in wanted:
            parent = gltf.nodes[number].parent
            root = number if parent is None else root_of[parent]
            root_of[number] = root
            trees.setdefault(root, []).append(number)
    best = max(trees.values(), key=lambda tree: (_fit(gltf, tree), len(tree)))
    others = [gltf.nodes[root].name for root, tree in trees.items() if tree is not best]
    if others:
        warnings.warn(
            f"{gltf.file}: has several skeletons; {gltf.nodes[best[0]].name!r} is read, "
            f"left out: {', '.join(others[:5])}{', ...' if len(others) > 5 else ''}",
            FbaWarning,
            stacklevel=5,
        )
    return best


def _root(names: list[str]) -> int:
    """The hips: what stands above them (an armature, the root of a game's figure) moves them as a whole."""
    try:
        return matching.match(names)[1]["HumanoidRoot"]
    except ModelError:
        return 0


def _below(parents: list[int], root: int) -> list[int]:
    """A joint and all that hang on it, parents first."""
    result = {root}
    for number, parent in enumerate(parents):
        if parent in result:
            result.add(number)
    return sorted(result)


def _fit(gltf: Gltf, tree: list[int]) -> int:
    try:
        return len(matching.match([gltf.nodes[number].name for number in tree])[1])
    except ModelError:
        return 0


def _clip(gltf: Gltf, clip: str | int | None, nodes: set[int]) -> Clip:
    moving = [a for a in gltf.animations if any(c.node in nodes and c.path == "rotation" for c in a.channels)]
    names = ", ".join(repr(a.name) for a in gltf.animations[:8])
    if clip is None:
        if not moving:
            raise ModelError(
                f"{gltf.file}: no animation turns the joints of the skeleton; there is no motion"
            )
        if len(moving) > 1:
            text = f"{gltf.file}: has {len(moving)} animations, {names}; {moving[0].name!r} is read"
            warnings.warn(
                FbaWarning(text).with_remedies(Remedy("clip", "choose with {}", repr(moving[1].name))),
                stacklevel=5,
            )
        return moving[0]
    if isinstance(clip, int):
        found = gltf.animations[clip] if 0 <= clip < len(gltf.animations) else None
    else:
        found = next((a for a in gltf.animations if a.name == clip), None)
    if found is None or not any(channel.node in nodes for channel in found.channels):
        raise ModelError(
            f"{gltf.file}: no animation {clip!r} moves the skeleton; there are {names or 'none'}"
        )
    return found


def _rate(times: Float64) -> Fraction:
    """Frames a second of regular keys: the usual rate that fits most of their distances."""
    steps = np.diff(times)
    steps = steps[steps > 1e-4]
    if not len(steps):
        return DEFAULT_RATE
    shortest = float(np.percentile(steps, 25))
    for rate in USUAL_RATES:
        whole = steps * rate
        if rate * shortest > 0.9 and (np.abs(whole - np.rint(whole)) < 0.02).mean() > 0.95:
            return Fraction(rate)
    return DEFAULT_RATE


def _say_stretched(motion: SkeletonMotion, places: Float64) -> None:
    """Joints that move against their parents are held where they are in the bind pose."""
    size = float(np.ptp(motion.rest(), axis=0).max()) or 1.0
    kept = motion.world()[1]
    moved = np.abs(kept - places).max(axis=(0, 2)) > STRETCH * size
    if moved.any():
        names = [motion.names[number] for number in np.flatnonzero(moved)]
        warnings.warn(
            f"{motion.name}: joints that move against their parents, or stand elsewhere than in the bind "
            f"pose, are held as they are there: {', '.join(names[:5])}{', ...' if len(names) > 5 else ''}",
            FbaWarning,
            stacklevel=5,
        )
