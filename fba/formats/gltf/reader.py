"""Read glTF 2.0 skeletons: animated joints, such as those that exporters write from FBX, become BAPs.

A glTF skeleton rests in its bind pose, in which joints may be turned; in a `SkeletonMotion` at rest all
rotations are the identity. So rotations are taken relative to the bind pose, in the scene's frame.
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
from fba.formats.gltf._own_files import find_note, read_note
from fba.formats.gltf._pose import Sampler, find_bind_pose, key_times
from fba.gltf import Animation as Clip
from fba.gltf import Gltf, read_gltf
from fba.source import Path

USUAL_RATES = (24, 25, 30, 48, 50, 60, 90, 100, 120, 240)
DEFAULT_RATE = Fraction(30)
STRETCH = 0.01
"""Share of the skeleton's size by which a joint may move relative to its parent without a warning."""


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
    """Read the animation of a glTF skeleton as BAPs.

    The options are those of `fba.capture.from_skeleton`; clip: see `read_motion`. BAPs and FAPs in files of
    this project are read as they are, with their own frames, unless an option other than clip and rate asks
    for retargeting.

    Raises FormatError for anything that is not glTF, or whose skeleton is not a body; warns (FbaWarning)
    of what is left out.
    """
    try:
        gltf = read_gltf(path)
        plain = (joints, scale, origin, ground, plant, spine) == (
            None, None, "source", "floor", True, "spread",
        )  # fmt: skip
        if plain and gltf.animations:
            own = (
                gltf.animations[0] if clip is None else _choose_clip(gltf, clip, set(range(len(gltf.nodes))))
            )
            note = find_note(gltf, own)
            if note is not None:
                animation = read_note(gltf, own, note)
                return animation if rate is None else animation.resample(Fraction(rate))
        motion = sample_motion(gltf, clip=clip, rate=rate)
        return from_skeleton(
            motion, joints=joints, scale=scale, origin=origin, ground=ground, plant=plant, spine=spine
        )
    except ModelError as error:
        raise FormatError(error.finding.removeprefix(f"{path}: "), path=path).with_remedies(
            *error.remedies
        ) from error


def read_motion(
    path: Path, *, clip: str | int | None = None, rate: Fraction | int | str | None = None
) -> SkeletonMotion:
    """Return the joints of a glTF file and one of its animations, sampled.

    clip: name or number (from 0) of the animation; None for the first that moves the skeleton. rate: frames
    per second; None for that of the keys if they are regular, else 30. Raises FormatError, ModelError; warns
    (FbaWarning) if there are several animations or skeletons to choose from.
    """
    return sample_motion(read_gltf(path), clip=clip, rate=rate)


def sample_motion(
    gltf: Gltf, *, clip: str | int | None = None, rate: Fraction | int | str | None = None
) -> SkeletonMotion:
    """Do the same as `read_motion` for a file that has been read."""
    try:
        return _sample_motion(gltf, clip, rate)
    except ModelError as error:
        found = error.finding.removeprefix(f"{gltf.file}: ")
        raise ModelError(f"{gltf.file}: {found}").with_remedies(*error.remedies) from error


def _sample_motion(gltf: Gltf, clip: str | int | None, rate: Fraction | int | str | None) -> SkeletonMotion:
    nodes = _skeleton(gltf)
    chosen = _choose_clip(gltf, clip, set(nodes))
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
    sample_times = first + np.arange(count) / float(frames)
    parents = [nodes.index(p) if (p := gltf.nodes[node].parent) in nodes else -1 for node in nodes]
    bind = find_bind_pose(gltf, nodes, parents)
    sampler = Sampler(gltf, channels, sample_times)

    # the transforms of all nodes of the skeleton in the scene's frame
    turned = np.zeros((count, len(nodes), 4))
    positions = np.zeros((count, len(nodes), 3))
    linear: list[Float64] = []
    for number, node in enumerate(nodes):
        local = sampler.linear(node)
        parent = parents[number]
        shift = sampler.translation(node)
        if parent < 0:
            above = gltf.nodes[node].parent
            base = np.eye(4) if above is None else gltf.nodes[above].world
            linear.append(base[:3, :3] @ local)
            positions[:, number] = shift @ base[:3, :3].T + base[:3, 3]
        else:
            linear.append(linear[parent] @ local)
            positions[:, number] = positions[:, parent] + (linear[parent] @ shift[:, :, None])[:, :, 0]
        turned[:, number] = bind.turned(number, linear[number])
    used = _descendants(parents, _find_root([gltf.nodes[node].name for node in nodes]))
    local_turns = turned[:, used]
    for row, number in enumerate(used[1:], 1):
        inverse = turned[:, parents[number]] * [1, -1, -1, -1]
        local_turns[:, row] = rotations.multiply(inverse, turned[:, number])
    motion = SkeletonMotion(
        names=tuple(gltf.nodes[nodes[number]].name for number in used),
        parents=np.array([used.index(parents[n]) if row else -1 for row, n in enumerate(used)]),
        offsets=bind.offsets()[used],
        rotations=local_turns / np.linalg.norm(local_turns, axis=-1, keepdims=True),
        positions=positions[:, used[0]],
        rate=frames,
        name=chosen.name,
    )
    _warn_of_stretching(motion, positions[:, used])
    return motion


def _skeleton(gltf: Gltf) -> list[int]:
    """Return the nodes of the skeleton, parents first, with one root.

    They are the joints of skins, or else the animated nodes and their children, and all nodes above. Of
    several skeletons, the one with most known joints; warns (FbaWarning) of the others.
    """
    wanted = {joint for skin in gltf.skins for joint in skin.joints}
    if not wanted:
        wanted = {channel.node for clip in gltf.animations for channel in clip.channels}
        wanted |= {number for number, node in enumerate(gltf.nodes) if node.parent in wanted}
    if not wanted:
        raise ModelError(
            f"{gltf.file}: has neither a skin with joints nor an animation; there is no skeleton"
        )
    for number in reversed(gltf.order):  # with all nodes above, so that the joints are connected
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


def _find_root(names: list[str]) -> int:
    """Return the position of the hips, or 0. Nodes above them (an armature, a game's root) only move all."""
    try:
        return matching.match(names)[1]["HumanoidRoot"]
    except ModelError:
        return 0


def _descendants(parents: list[int], root: int) -> list[int]:
    """Return a joint and all below it, parents first."""
    result = {root}
    for number, parent in enumerate(parents):
        if parent in result:
            result.add(number)
    return sorted(result)


def _fit(gltf: Gltf, tree: list[int]) -> int:
    """Return the number of nodes whose names are known."""
    try:
        return len(matching.match([gltf.nodes[number].name for number in tree])[1])
    except ModelError:
        return 0


def _choose_clip(gltf: Gltf, clip: str | int | None, nodes: set[int]) -> Clip:
    """Return the animation with this name or number, or the first that turns one of the nodes.

    ModelError if there is none; warns (FbaWarning) if there are several and clip is None.
    """
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
        match = gltf.animations[clip] if 0 <= clip < len(gltf.animations) else None
    else:
        match = next((a for a in gltf.animations if a.name == clip), None)
    if match is None or not any(channel.node in nodes for channel in match.channels):
        raise ModelError(
            f"{gltf.file}: no animation {clip!r} moves the skeleton; there are {names or 'none'}"
        )
    return match


def _rate(times: Float64) -> Fraction:
    """Return frames per second of regular keys: the usual rate that fits most of their intervals, else 30."""
    steps = np.diff(times)
    steps = steps[steps > 1e-4]
    if not len(steps):
        return DEFAULT_RATE
    shortest = float(np.percentile(steps, 25))
    for rate in USUAL_RATES:
        frames = steps * rate
        if rate * shortest > 0.9 and (np.abs(frames - np.rint(frames)) < 0.02).mean() > 0.95:
            return Fraction(rate)
    return DEFAULT_RATE


def _warn_of_stretching(motion: SkeletonMotion, positions: Float64) -> None:
    """Warn of joints that move relative to their parents: `motion` keeps them as in the bind pose.

    positions: (T, J, 3), where the file has the joints.
    """
    size = float(np.ptp(motion.rest(), axis=0).max()) or 1.0
    rigid = motion.world()[1]
    moved = np.abs(rigid - positions).max(axis=(0, 2)) > STRETCH * size
    if moved.any():
        names = [motion.names[number] for number in np.flatnonzero(moved)]
        warnings.warn(
            f"{motion.name}: joints that move against their parents, or stand elsewhere than in the bind "
            f"pose, are held as they are there: {', '.join(names[:5])}{', ...' if len(names) > 5 else ''}",
            FbaWarning,
            stacklevel=5,
        )
