"""Read BVH (Biovision hierarchy) text: a skeleton with offsets and channels, then a line for each frame.

Line ends, tabs and the order of channels may vary; lines may be wrapped or cut short, the frame count wrong.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np

from fba.arrays import Float64
from fba.capture import SkeletonMotion
from fba.errors import FbaWarning, FormatError
from fba.limits import DEFAULT_LIMITS, Limits
from fba.recognition import HEAD_BYTES, recognition_hint
from fba.source import read_whole

MAX_JOINTS = 4096
MAX_FRAME_RATE = 10_000
"""Highest rate, in frames per second."""
MAX_LINES = 4 * SkeletonMotion.MAX_FRAMES
MAX_NUMBER = 1e12
"""Largest length or angle; more is damage."""
BATCH_LINES = 4096
"""Lines that are parsed at once."""
NOMINAL_RATES = tuple(
    sorted({Fraction(n) for n in range(1, 241)} | {Fraction(n * 1000, 1001) for n in (24, 30, 48, 60, 120)}
           | {Fraction(n) for n in (250, 300, 480, 500, 1000)})
)  # fmt: skip
"""Frame rates that a rounded frame time probably means."""
MAX_LINE = 1 << 20
"""Longest line, in characters: 4096 joints have far fewer numbers."""
MAX_STRETCH = 1e-3
"""Share of the skeleton's size by which a joint may move relative to its parent without a warning."""


@dataclass(frozen=True)
class _CarrierRule:
    """When a joint below the root carries the body, such as the hips below the root of a scene."""

    min_joints: float = 0.75
    """Share of all joints that must be below it."""
    min_reach: float = 5.0
    """How many times as far it must move as the joints below it: in files of markers all joints move."""
    min_moving: int = 3
    """Count of joints below it that must move for this comparison: faces and toys move by themselves."""


CARRIER = _CarrierRule()


@dataclass(frozen=True)
class _Text:
    """The lines of a file, and its name for errors. Lines are numbered from 0, in messages from 1."""

    lines: list[str]
    path: str | Path | None

    def error(self, message: str, line: int | None = None, token: str | None = None) -> FormatError:
        """Return the error about a line."""
        return FormatError(message, path=self.path, line=None if line is None else line + 1, token=token)

    def warn(self, message: str, line: int | None = None) -> None:
        """Warn (FbaWarning) about the file, or about a line."""
        place = "" if line is None else f":{line + 1}"
        warnings.warn(f"{self.path or 'BVH'}{place}: {message}", FbaWarning, stacklevel=5)

    def number(self, word: str, line: int, *, any_size: bool = False) -> float:
        """Return a number; FormatError for other words. any_size: allow more than `MAX_NUMBER`."""
        try:
            value = float(word)
        except ValueError:
            value = math.nan
        if not (any_size or abs(value) <= MAX_NUMBER) or math.isnan(value):
            raise self.error("expected a number", line, word)
        return value


@dataclass
class _Hierarchy:
    """Joints in file order. channels: lower-case names. end_parents, end_offsets: of the End Sites."""

    names: list[str] = field(default_factory=list)
    parents: list[int] = field(default_factory=list)
    offsets: list[tuple[float, float, float]] = field(default_factory=list)
    channels: list[list[str]] = field(default_factory=list)
    end_parents: list[int] = field(default_factory=list)
    end_offsets: list[tuple[float, float, float]] = field(default_factory=list)


def sniff(head: bytes, suffix: str) -> bool:
    """Whether the first bytes of a file look like BVH."""
    return re.match(rb"(?:\xef\xbb\xbf)?\s*HIERARCHY\s+ROOT\b", head, re.IGNORECASE) is not None


def read_motion(path: str | Path, *, limits: Limits = DEFAULT_LIMITS) -> SkeletonMotion:
    """Return the skeleton and its motion as they are in the file.

    Raises FormatError, and LimitError for more than the limits allow; warns (FbaWarning).
    """
    data = read_whole(path)
    kind = recognition_hint(data[:HEAD_BYTES])
    if kind and not re.match(rb"(?:\xef\xbb\xbf)?\s*HIERARCHY\b", data, re.IGNORECASE):
        raise FormatError(f"a BVH file begins with HIERARCHY{kind}", path=path)
    text = data.decode("utf-8-sig", errors="replace")
    return parse(text, name=Path(path).stem, path=path, limits=limits)


def parse(
    text: str, *, name: str = "", path: str | Path | None = None, limits: Limits = DEFAULT_LIMITS
) -> SkeletonMotion:
    """Return the motion in text, as `read_motion` does. path: the file, for messages."""
    if max(text.count("\n"), text.count("\r")) > MAX_LINES:
        raise FormatError(f"more than {MAX_LINES} lines; cut the motion into pieces", path=path)
    source = _Text(text.splitlines(), path)
    tree, after = _hierarchy(source)
    count, frame_time, first = _motion_header(source, after)
    channels = sum(len(c) for c in tree.channels)
    numbers = _numbers(source, first, channels, count)
    content = f"{len(tree.names)} joints, {channels} channels and {len(numbers)} frames"
    what = f"{path or 'BVH'}: a motion of {content}"
    SkeletonMotion.check_memory(limits, len(numbers), len(tree.names), what, len(text))
    return _motion(tree, numbers, _rate(frame_time), name, source)


def _hierarchy(source: _Text) -> tuple[_Hierarchy, int]:
    """Return the joints, and the line of MOTION. Not recursive: files may nest deeply."""
    tree = _Hierarchy()
    stack: list[int] = []  # open braces: number of the joint, -1 for an End Site
    pending: int | None = None  # joint of the last ROOT or JOINT, -1 for End Site, until its brace opens
    seen_header = False
    for number, line in enumerate(source.lines):
        words = line.replace("{", " { ").replace("}", " } ").split()
        position = 0
        while position < len(words):
            word = words[position].upper()

            def fail(message: str, number: int = number, token: str = words[position]) -> FormatError:
                return source.error(message, number, token)

            if not seen_header:
                if word != "HIERARCHY":
                    raise fail("a BVH file begins with HIERARCHY")
                seen_header = True
                position += 1
            elif word in ("ROOT", "JOINT"):
                if word == "ROOT" and tree.names:
                    raise fail("this file has several ROOTs; split it into files of one skeleton each")
                if word == "JOINT" and (not stack or stack[-1] < 0):
                    raise fail("a JOINT must stand inside a ROOT or JOINT")
                if len(tree.names) >= MAX_JOINTS:
                    raise fail(f"more than {MAX_JOINTS} joints; remove those that are not needed")
                pending = len(tree.names)
                end = next((i for i in range(position + 1, len(words)) if words[i] == "{"), len(words))
                tree.names.append(" ".join(words[position + 1 : end]) or f"joint{pending}")
                tree.parents.append(stack[-1] if stack else -1)
                tree.offsets.append((0.0, 0.0, 0.0))
                tree.channels.append([])
                position = end
            elif word == "END":
                if not stack or stack[-1] < 0:
                    raise fail("an End Site must stand inside a joint")
                pending = -1
                tree.end_parents.append(stack[-1])
                tree.end_offsets.append((0.0, 0.0, 0.0))
                position = next((i for i in range(position + 1, len(words)) if words[i] == "{"), len(words))
            elif word == "{":
                if pending is None:
                    raise fail("a brace opens, but no ROOT, JOINT or End Site stands before it")
                stack.append(pending)
                pending = None
                position += 1
            elif word == "}":
                if not stack:
                    raise fail("a brace closes that was never opened")
                stack.pop()
                position += 1
            elif word == "OFFSET":
                values = [source.number(w, number) for w in words[position + 1 : position + 4]]
                if not stack or len(values) != 3:
                    raise fail("OFFSET needs three numbers, inside a joint or End Site")
                offset = (values[0], values[1], values[2])
                if stack[-1] < 0:
                    tree.end_offsets[-1] = offset
                else:
                    tree.offsets[stack[-1]] = offset
                position += 4
            elif word == "CHANNELS":
                position = _channels(tree, stack, words, position, source, number)
            elif word == "MOTION":
                if stack or pending is not None:
                    raise fail(f"MOTION begins, but {len(stack)} braces are still open; close them first")
                if not tree.names:
                    raise fail("there is no ROOT joint before MOTION")
                return tree, number
            else:
                raise fail("expected ROOT, JOINT, End Site, OFFSET, CHANNELS, a brace or MOTION")
    raise source.error(
        "the file ends before MOTION; it is cut short, or not a BVH file", len(source.lines) - 1
    )


def _channels(
    tree: _Hierarchy, stack: list[int], words: list[str], position: int, source: _Text, line: int
) -> int:
    """Read CHANNELS of a joint; return the position of the next word."""
    text = words[position + 1] if position + 1 < len(words) else ""
    if not stack or stack[-1] < 0 or not re.fullmatch(r"[0-9]{1,2}", text):
        raise source.error("expected CHANNELS inside a joint, followed by the number of channels", line, text)
    names = [w.lower() for w in words[position + 2 : position + 2 + int(text)]]
    for channel in names:
        if not re.fullmatch(r"[xyz](rotation|position)", channel):
            expected = "Xposition, Yposition, Zposition, Xrotation, Yrotation or Zrotation"
            raise source.error(f"expected a channel: {expected}", line, channel)
    if len(names) != int(text) or tree.channels[stack[-1]]:
        raise source.error(
            f"CHANNELS must stand once in each joint, with {text} names behind its number", line
        )
    tree.channels[stack[-1]] = names
    return position + 2 + int(text)


def _motion_header(source: _Text, start: int) -> tuple[int | None, str, int]:
    """Return the stated number of frames, the frame time as text, and the line after it."""
    stated: int | None = None
    for number, text in enumerate(source.lines[start : start + 50], start):
        line = " ".join(text.split())  # the time that the patterns take grows with the square of the blanks
        frames = re.search(r"\bFrames ?:? ?([0-9]{1,18})\b", line, re.IGNORECASE)
        if frames:
            stated = int(frames[1])
        time = re.search(r"\bFrame Time ?:? ?(\S+)$", line, re.IGNORECASE)
        if time:
            value = source.number(time[1], number)
            if not 1 / MAX_FRAME_RATE <= value <= 3600:
                raise source.error(
                    f"the frame time must lie between 1/{MAX_FRAME_RATE} s and an hour", number, time[1]
                )
            return stated, time[1], number + 1
    raise source.error("there is no 'Frame Time: <seconds>' after MOTION", start)


def _numbers(source: _Text, first: int, channels: int, stated: int | None) -> Float64:
    """Return float64 (T, channels). No memory is allocated for the stated number of frames."""
    if not channels:
        raise source.error("no joint has channels, so nothing can move")
    lines = source.lines
    blocks: list[Float64] = []
    row_lines: list[int] = []  # the line of each row
    counts: list[int] = []  # of the numbers in each row
    batch: list[str] = []
    total = 0
    for number in range(first, len(lines)):
        if len(lines[number]) > MAX_LINE:
            raise source.error(f"a line of more than {MAX_LINE} characters; are its line ends lost?", number)
        words = lines[number].split()
        if not words:
            continue
        row_lines.append(number)
        counts.append(len(words))
        total += len(words)
        batch += words
        if total // channels > SkeletonMotion.MAX_FRAMES:
            raise source.error(
                f"more than {SkeletonMotion.MAX_FRAMES} frames; cut the motion into pieces", number
            )
        if len(row_lines) % BATCH_LINES == 0:
            blocks.append(_floats(batch, source, row_lines[-BATCH_LINES:]))
            batch = []
    blocks.append(_floats(batch, source, row_lines[-BATCH_LINES:]))
    frames, lost = divmod(total, channels)
    if not frames:
        raise source.error("there is no frame of motion after 'Frame Time'", first)
    bad = next((row for row, count in enumerate(counts) if count != channels), None)
    if bad is not None:
        wrapped = stated is not None and total == stated * channels
        cut = bad == len(counts) - 1 and counts[bad] < channels
        if not (wrapped or cut):
            raise source.error(
                f"expected {channels} numbers, one for each channel, found {counts[bad]}", row_lines[bad]
            )
        if cut and not wrapped:
            source.warn(
                f"the last frame is cut short ({lost} of {channels} numbers); left out", row_lines[bad]
            )
    if stated is not None and stated != frames:
        source.warn(f"the header says {stated} frames, but the file has {frames}; these are read")
    values = np.concatenate(blocks)[: frames * channels]
    wrong = np.flatnonzero(~(np.abs(values) <= MAX_NUMBER))
    if len(wrong):
        ends = np.cumsum(counts)
        row = int(np.searchsorted(ends, wrong[0], side="right"))
        raise source.error(
            f"the values of channels must be finite numbers of at most {MAX_NUMBER:g}",
            row_lines[row],
            lines[row_lines[row]].split()[int(wrong[0] - ends[row])],
        )
    return values.reshape(frames, channels)


def _floats(batch: list[str], source: _Text, rows: Sequence[int]) -> Float64:
    """Return the numbers in words; FormatError for a word that is no number. rows: the lines of the words."""
    try:
        return np.array([float(word) for word in batch], dtype=np.float64)
    except ValueError:
        for line in rows:
            for word in source.lines[line].split():
                source.number(word, line, any_size=True)
        raise


def _rate(frame_time: str) -> Fraction:
    """Return frames per second: the nominal rate nearest to the rounded frame time of a file."""
    value = float(frame_time)
    digits = -int(Decimal(frame_time).as_tuple().exponent)
    tolerance = max(0.5 * 10.0**-digits * 1.01, value * 2e-5)
    near = [r for r in NOMINAL_RATES if abs(1 / float(r) - value) <= tolerance]
    if near:
        # integral rates first: a coarse 0.033 is 30, not 29.97
        off = {rate: abs(1 / float(rate) - value) for rate in near}
        return min(near, key=lambda rate: (off[rate] > tolerance / 5, rate.denominator > 1, off[rate]))
    if value > 1:
        return 1 / Fraction(value).limit_denominator(1000)
    return Fraction(1 / value).limit_denominator(1000)


def _motion(tree: _Hierarchy, numbers: Float64, rate: Fraction, name: str, source: _Text) -> SkeletonMotion:
    """Return the motion that numbers (T, channels) describe."""
    from fba import rotations

    frames, joints = len(numbers), len(tree.names)
    offsets = np.array(tree.offsets)
    turned = np.zeros((frames, joints, 4))
    turned[:, :, 0] = 1.0
    positions = np.tile(offsets[0], (frames, 1))
    size = float(np.abs(offsets).sum(axis=1).max()) or 1.0
    moved: dict[int, Float64] = {}  # positions relative to the parent, where they vary
    from_offset = _count_from_offset(tree, numbers)
    column = 0
    for joint, channels in enumerate(tree.channels):
        translation = np.tile(offsets[joint], (frames, 1))
        for channel in channels:
            axis = "xyz".index(channel[0])
            if channel.endswith("position"):
                start = offsets[joint, axis] if from_offset and joint else 0.0
                translation[:, axis] = start + numbers[:, column]
            else:
                turn = rotations.axis_quaternions(axis, np.deg2rad(numbers[:, column]))
                turned[:, joint] = rotations.multiply(turned[:, joint], turn)
            column += 1
        if joint == 0:
            positions = translation
        elif any(c.endswith("position") for c in channels):
            if np.abs(translation - translation[0]).max() > MAX_STRETCH * size:
                moved[joint] = translation
            offsets[joint] = np.median(translation, axis=0)
    turned /= np.linalg.norm(turned, axis=-1, keepdims=True)
    hips = _moving_body(tree.parents, moved)
    if hips:
        above = hips
        turn, place = turned[:, hips], moved[hips]
        while (above := tree.parents[above]) >= 0:
            fixed = np.broadcast_to(offsets[above], place.shape)
            shift = positions if above == 0 else moved.get(above, fixed)
            place = shift + (rotations.matrices(turned[:, above]) @ place[:, :, None])[:, :, 0]
            turn = rotations.multiply(turned[:, above], turn)
        turned[:, hips], positions, offsets[hips] = turn, place, place[0]
    stretched = [tree.names[joint] for joint in moved if joint > hips]
    if stretched:
        source.warn(
            "joints whose offset from the parent varies keep the median of it: "
            f"{', '.join(stretched[:5])}{', ...' if len(stretched) > 5 else ''}"
        )
    kept = _subtree(tree.parents, hips)
    row_of = {joint: row for row, joint in enumerate(kept)}
    ends = [row for row, joint in enumerate(tree.end_parents) if joint in row_of]
    return SkeletonMotion(
        names=tuple(tree.names[joint] for joint in kept),
        parents=np.array([row_of.get(tree.parents[joint], -1) for joint in kept], dtype=np.int64),
        offsets=offsets[kept],
        rotations=turned[:, kept] if hips else turned,
        positions=positions,
        rate=rate,
        end_parents=np.array([row_of[tree.end_parents[row]] for row in ends], dtype=np.int64),
        end_offsets=np.array([tree.end_offsets[row] for row in ends], dtype=np.float64).reshape(-1, 3),
        name=name,
    )


def _count_from_offset(tree: _Hierarchy, numbers: Float64) -> bool:
    """Whether positions of joints below the root are relative to their OFFSET, as in MakeHuman's files.

    In other files they contain it. numbers: (T, channels).
    """
    away = from_offset = 0.0
    column = 0
    for joint, channels in enumerate(tree.channels):
        for channel in channels:
            if joint and channel.endswith("position"):
                value = float(np.median(numbers[:, column])) if len(numbers) else 0.0
                away += abs(value - tree.offsets[joint]["xyz".index(channel[0])])
                from_offset += abs(value)
            column += 1
    return from_offset < away


def _moving_body(parents: list[int], moved: dict[int, Float64]) -> int:
    """Return the joint below the root that carries the body, see `_CarrierRule`; else 0, the root.

    moved: positions (T, 3) of joints relative to their parents, where they vary.
    """
    reach = {joint: float(np.ptp(positions, axis=0).max()) for joint, positions in moved.items()}
    size = [1] * len(parents)
    for joint in range(len(parents) - 1, 0, -1):
        size[parents[joint]] += size[joint]
    for joint in moved:
        below = [reach[other] for other in _subtree(parents, joint)[1:] if other in reach]
        usual = float(np.median(below)) if len(below) >= CARRIER.min_moving else 0.0
        if size[joint] >= CARRIER.min_joints * len(parents) and reach[joint] > CARRIER.min_reach * usual:
            return joint
    return 0


def _subtree(parents: list[int], root: int) -> list[int]:
    """Return a joint and all below it, in order."""
    inside = {root}
    for joint in range(root + 1, len(parents)):
        if parents[joint] in inside:
            inside.add(joint)
    return sorted(inside)
