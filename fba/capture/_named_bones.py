"""Find the bones of a skeleton from the words in the names of its joints, and from their hierarchy.

A word such as "shoulder" or "leg" means different joints in different files. So each limb is matched as a
whole: all assignments of its parts to joints, in order from the trunk, are scored by the words and by the
lengths of bones, and the best counts. bone_words.csv says of each word which part of the body it names, and
which side (`read`).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations, pairwise

import numpy as np

from fba.arrays import Float64
from fba.body import ROOT, Skeleton
from fba.capture._spine import heights as spine_heights
from fba.capture._spine import joints as spine_joints
from fba.capture.motion import SkeletonMotion
from fba.text_files import packaged_rows

MAX_NAME_LENGTH = 200
"""Largest number of characters of a name that are read, from its end."""
JOINED_WORDS = {
    ("upper", "arm"): "upperarm",
    ("upper", "leg"): "thigh",
    ("lower", "arm"): "forearm",
    ("fore", "arm"): "forearm",
    ("lower", "leg"): "shank",
    ("collar", "bone"): "collar",
    ("fore", "foot"): "toe",
    ("shoulder", "blade"): "clavicle",
    ("toe", "base"): "toe",
    ("up", "arm"): "upperarm",
    ("up", "leg"): "thigh",
    ("low", "arm"): "forearm",
    ("low", "leg"): "shank",
}
"""Pairs of words that mean the same as a single word."""
LIMBS = {
    "leg": (("thigh", "hip"), ("shank", "knee"), ("foot", "ankle")),
    "arm": (("upperarm", "shoulder"), ("forearm", "elbow"), ("hand", "wrist")),
}
"""Words of the three parts of a limb, and the body's joints where they begin."""
FINGERS = ("thumb", "index", "middle", "ring", "pinky")
MIN_LENGTH_RATIO = 0.3
"""Smallest plausible ratio of the lengths of a limb's two bones, shorter to longer."""
HELPER_COST = 3
"""What the score of a joint loses if its name calls it a helper, such as "twist"; a certain word gains 2."""
MAX_CHAIN = 16
"""Largest number of joints that are tried for the parts of a limb."""
MAX_ENDS = 32
"""Largest number of hands or feet of one side that are tried."""


def find(motion: SkeletonMotion, skeleton: Skeleton) -> dict[str, int]:
    """Return joint of the body -> number of the source's joint; empty without two whole legs."""
    joints = NamedJoints(motion)
    mapped: dict[str, int] = {}
    for side in "lr":
        for limb in LIMBS:
            mapped |= joints.limb(side, limb)
    if not any(f"{side}_shoulder" in mapped for side in "lr") and joints.have_four_legs(mapped):
        return {}
    if not all(f"{side}_{joint}" in mapped for side in "lr" for joint in ("hip", "knee", "ankle")):
        return {}
    hips = joints.above_both(int(motion.parents[mapped["l_hip"]]), int(motion.parents[mapped["r_hip"]]))
    if hips < 0:
        return {}
    trunk = joints.above_both(hips, next(iter(joints.named("", "head")), hips))
    if trunk not in (-1, hips):  # DAZ: legs and back hang on a joint above the pelvis
        mapped["sacroiliac"], hips = hips, trunk
    mapped[ROOT] = hips
    for side in "lr":
        mapped |= joints.toe(side, mapped[f"{side}_ankle"])
        if f"{side}_shoulder" in mapped:
            mapped |= joints.clavicle(side, mapped[f"{side}_shoulder"])
        if f"{side}_wrist" in mapped:
            mapped |= joints.fingers(side, mapped[f"{side}_wrist"])
    mapped |= joints.spine(mapped, skeleton)
    return {joint: number for joint, number in mapped.items() if joint in skeleton}


class NamedJoints:
    """The joints of a source, with the meanings of their names.

    Its methods `limb`, `toe`, `clavicle`, `fingers` and `spine` return joint of the body -> number of the
    source's joint; the joints that they are given are numbers, too.
    """

    def __init__(self, motion: SkeletonMotion) -> None:
        self.motion, self.names, self.parents = motion, motion.names, motion.parents
        self.meanings = [read(name) for name in motion.names]
        self.lengths = np.linalg.norm(motion.offsets, axis=1)

    def named(self, side: str, part: str = "", among: Sequence[int] | None = None) -> list[int]:
        """Return the joints of a side that are no helpers; with a part, those that are named so."""
        return [
            number
            for number in (range(len(self.names)) if among is None else among)
            if self.meanings[number].side == side
            and not self.meanings[number].helper
            and (not part or part in self.meanings[number].parts)
        ]

    def path(self, joint: int) -> list[int]:
        """Return the joints from the root down to a joint; none for -1."""
        path: list[int] = []
        while joint >= 0:
            path.append(joint)
            joint = int(self.parents[joint])
        return path[::-1]

    def above_both(self, first: int, second: int) -> int:
        """Return the last joint on the paths from the root to both joints; -1 without any."""
        shared = [a for a, b in zip(self.path(first), self.path(second), strict=False) if a == b]
        return shared[-1] if shared else -1

    def limb(self, side: str, limb: str) -> dict[str, int]:
        """Return the three joints of a limb; empty if no joints are likely to be it."""
        parts = LIMBS[limb]
        words = {part for part, _ in parts}
        other_words = {part for key, value in LIMBS.items() if key != limb for part, _ in value}
        best: tuple[float, tuple[int, ...]] = (-np.inf, ())
        ends = self.named(side, parts[2][0])
        for end in ends[:MAX_ENDS]:
            path = self.path(end)
            chain = [
                number
                for number in path
                if self.meanings[number].side in (side, "")
                and not other_words & _certain(self.meanings[number])
            ][-MAX_CHAIN:]
            chain = [
                number
                for number in chain
                if self.meanings[number].side == side or self.meanings[number].parts.keys() & words
            ]
            reach = dict(zip(path, np.cumsum(self.lengths[path]).tolist(), strict=True))
            for three in combinations(chain, 3):
                score = sum(
                    _score(self.meanings[number], part, side)
                    for number, (part, _) in zip(three, parts, strict=True)
                )
                bones = [reach[b] - reach[a] for a, b in pairwise(three)]
                if min(bones) < MIN_LENGTH_RATIO * max(bones):
                    score -= 2
                score += (
                    0.01 * (three[0] - end) / max(len(self.names), 1)
                )  # of two hips, the closer to the knee
                if score > best[0]:
                    best = (score, three)
        if best[0] < 3:
            return {} if ends else self._numbered_limb(side, limb)
        return {f"{side}_{joint}": number for number, (_, joint) in zip(best[1], parts, strict=True)}

    def _numbered_limb(self, side: str, limb: str) -> dict[str, int]:
        """Return the joints of a limb that differ by numbers only, "leg_joint_L_1" to 3 from the trunk.

        The fourth of a leg is that of the toes. Empty for several such limbs, as of animals.
        """
        named = {number for part, _ in LIMBS[limb] for number in self.named(side, part)}
        chains = [[number] for number in sorted(named) if int(self.parents[number]) not in named]
        if len(chains) != 1:
            return {}
        chain = chains[0]
        while (
            len(below := [n for n in np.flatnonzero(self.parents == chain[-1]).tolist() if n in named]) == 1
        ):
            chain.append(below[0])
        joints = [f"{side}_{joint}" for _, joint in LIMBS[limb]]
        if limb == "leg":
            joints.append(f"{side}_metatarsal")
        return dict(zip(joints, chain, strict=False)) if len(chain) >= len(LIMBS[limb]) else {}

    def have_four_legs(self, mapped: dict[str, int]) -> bool:
        """Return whether each side has a leg beside the mapped leg, as animals have."""
        for side in "lr":
            leg = {mapped.get(f"{side}_{joint}") for joint in ("hip", "knee", "ankle")}
            for part, _ in LIMBS["leg"]:
                if not any(leg.isdisjoint(self.path(number)) for number in self.named(side, part)):
                    return False
        return True

    def toe(self, side: str, ankle: int) -> dict[str, int]:
        """Return the joint of the toes: the highest below the ankle with that name; the middle of several."""
        depths = {ankle: 0}
        for number in self.motion.descendants(ankle)[1:]:
            depths[number] = depths[int(self.parents[number])] + 1
        del depths[ankle]
        toes = [n for n in depths if "toe" in self.meanings[n].parts and not self.meanings[n].helper]
        if not toes:
            return {}
        sure = [number for number in toes if self.meanings[number].parts["toe"] > 1] or toes
        first = min(depths[number] for number in sure)
        level = [number for number in sure if depths[number] == first]
        return {f"{side}_metatarsal": level[(len(level) - 1) // 2]}

    def clavicle(self, side: str, shoulder: int) -> dict[str, int]:
        """Return the clavicle: the joint above the upper arm with that name, or with the arm's side."""
        above = self.path(shoulder)[:-1]
        joints = self.named(side, "clavicle", above) or self.named(side, "", above)
        return {f"{side}_sternoclavicular": joints[0]} if joints else {}

    def fingers(self, side: str, wrist: int) -> dict[str, int]:
        """Return three joints for each finger below a wrist."""
        numbered = [m.numbers[0] for m in self.meanings if "finger" in m.parts and m.numbers]
        first = 0 if any(_digit(number) == 0 for number in numbered) else 1  # the thumb's
        chains: dict[str, list[int]] = {}
        for number in self.motion.descendants(wrist)[1:]:
            meaning, name = self.meanings[number], self.names[number]
            named = [finger for finger in FINGERS if finger in meaning.parts]
            finger = next((f for f in named if f != "middle"), named[0] if named else None)  # "ring_mid"
            above = next((f for f, chain in chains.items() if int(self.parents[number]) in chain), None)
            if above is not None and (finger in (None, above)):
                finger = above
            elif finger is None and "finger" in meaning.parts and meaning.numbers:
                digit = meaning.numbers[0] if len(meaning.numbers) > 1 else _digit(meaning.numbers[0])
                finger = FINGERS[digit - first] if 0 <= digit - first < len(FINGERS) else None
            if finger is None or meaning.helper or (above is None and finger in chains):
                continue
            if "meta" in meaning.parts or "inhand" in name.lower():  # Rokoko: "LeftInHandIndex"
                continue
            chain = chains.setdefault(finger, [])
            if chain and _letters(self.names[chain[-1]]) == _letters(name):
                chain[-1] = number  # DAZ: "__lthumb" above "lthumb" stands still
            else:
                chain.append(number)
        result = {}
        for finger, chain in chains.items():
            numbers = [self.meanings[number].numbers for number in chain]
            start = 1 if len(chain) > 3 and not numbers[0] and numbers[1] else 0  # the first is in the palm
            for position, number in enumerate(chain[start : start + 3], 1):
                result[f"{side}_{finger}{position}"] = number
        return result

    def _crown(self, top: int) -> list[int]:
        """Return the joints of a neck and head without such names: the chain that rises between the arms.

        It begins above `top`, the joint that the arms hang on. Its joints have no side and are no helpers.
        """
        chain: list[int] = []
        while len(above := self.named("", among=np.flatnonzero(self.parents == top).tolist())) == 1:
            top = above[0]
            chain.append(top)
        return chain if len(chain) > 1 else []

    def spine(self, mapped: dict[str, int], skeleton: Skeleton) -> dict[str, int]:
        """Return the joints of back, neck and head, spread over the vertebrae by their heights."""
        hips = mapped[ROOT]
        limbs = set(mapped.values()) - {hips}
        below = self.motion.descendants(hips)[1:]
        heads, necks = self.named("", "head", below), self.named("", "neck", below)
        arms = [mapped[f"{side}_shoulder"] for side in "lr" if f"{side}_shoulder" in mapped]
        if heads:
            top = heads[0]
        elif necks:
            top = necks[-1]
        elif len(arms) == 2:
            top = max(self.above_both(*arms), 0) or hips
            necks = self._crown(top)
            if necks:  # vertebrae by their numbers, up to the one that carries the head
                top = necks.pop()
                heads = [top]
        else:
            return {}
        result = {"skullbase": top} if heads else {}
        path = self.path(top)
        if hips not in path:
            return result
        line = [number for number in path[path.index(hips) + 1 :] if number not in limbs]
        neck = [number for number in line if number in necks]
        neck = neck[:2] if len(neck) < 4 else [neck[0], neck[len(neck) // 2]]
        result |= dict(zip(("vc7", "vc4"), neck, strict=False))
        end = line.index(neck[0]) if neck else len(line) - (1 if heads else 0)
        return result | _vertebrae(line[:end], self.lengths[line[: end + 1]], skeleton)


def _certain(meaning: Meaning) -> set[str]:
    return {part for part, value in meaning.parts.items() if value > 1}


def _score(meaning: Meaning, part: str, side: str) -> float:
    """Return how well a name agrees with a part of a limb: 2 if it names it, less if it names another."""
    value = float(meaning.parts.get(part, -1.5 if meaning.parts else -0.5))
    if part in meaning.parts and len(_certain(meaning) - {part, "hips"}):
        value -= 1.0  # "LeftHandThumb1" is a thumb
    return value - HELPER_COST * meaning.helper - (0.5 if meaning.side != side else 0.0)


def _letters(name: str) -> str:
    return "".join(filter(str.isalnum, name)).lower()


def _digit(number: int) -> int:
    """Return the first digit: Biped's fingers are 0, 01, 02, 1, 11, 12, ..."""
    return int(str(number)[0])


def _vertebrae(back: Sequence[int], lengths: Float64, skeleton: Skeleton) -> dict[str, int]:
    """Return a vertebra for each joint of the back, the nearest to its height.

    lengths: of the bones below these joints, and below the next.
    """
    chain = spine_joints(skeleton)
    total = float(sum(lengths))
    if "vc7" not in chain or "vl5" not in chain or not back or total <= 0:
        return {}
    heights = spine_heights(skeleton, chain)
    first, last = chain.index("vl5"), chain.index("vc7")
    result = {}
    reach = 0.0
    at = first
    for count, number in enumerate(back):
        reach += float(lengths[count])
        nearest = int(np.argmin(np.abs(heights - reach / total * heights[last])))
        at = min(max(nearest, at), last - (len(back) - count))
        if at >= first:
            result[chain[at]] = number
        at += 1
    return result


@dataclass(frozen=True)
class Meaning:
    """What a name says.

    side: "l", "r" or "". parts: part -> 2 if named for certain, 1 if perhaps. numbers: the name's numbers, in
    order. helper: whether it names something that is no bone of a body, such as a twist bone, an end or an
    eye. unknown: count of letters that no word explains.
    """

    side: str
    parts: dict[str, int]
    numbers: tuple[int, ...]
    helper: bool
    unknown: int


@cache
def _words() -> dict[str, tuple[str, ...]]:
    """Return word -> what it means."""
    return {row["word"]: tuple(row["means"].split()) for row in packaged_rows(__package__, "bone_words.csv")}


def read(name: str) -> Meaning:
    """Return the meaning of a name: "mixamorig:LeftUpLeg", "thigh_l", "rshldr", "Bip01 R Calf"."""
    plain = re.split(r"[:|]", name[-MAX_NAME_LENGTH:])[-1]
    pieces = re.findall(r"[A-Z]+(?![a-zß-ÿ])|[A-Z]?[a-zß-ÿ]+|[0-9]+|[^\W\d_A-Za-zß-ÿ]+", plain)
    words: list[str] = []
    numbers: list[int] = []
    unknown = 0
    for piece in pieces:
        if piece.isascii() and piece.isdigit():
            numbers.append(int(piece[:9]))
            continue
        split = _split(piece.lower())
        if split is None:
            unknown += len(piece)
        else:
            words.extend(split)
    joined: list[str] = []
    for word in words:
        if joined and (joined[-1], word) in JOINED_WORDS:
            joined[-1] = JOINED_WORDS[joined[-1], word]
        else:
            joined.append(word)
    side, parts, helper = "", dict[str, int](), False
    for word in joined:
        for meaning in _words()[word]:
            part = meaning.removeprefix("?")
            if part in ("left", "right"):
                side = side or part[0]
            elif part == "helper":
                helper = True
            elif part != "neutral":
                parts[part] = max(parts.get(part, 0), 1 if meaning.startswith("?") else 2)
    return Meaning(side, parts, tuple(numbers), helper, unknown)


def _split(piece: str) -> list[str] | None:
    """Return the fewest words of the table that make up a piece; None if none do.

    The single letter of a side counts only at either end: "rhand", "lthighbend", but not "br-l-ow".
    """
    words = _words()
    best: list[list[str] | None] = [[]]
    for end in range(1, len(piece) + 1):
        shortest: list[str] | None = None
        for begin in range(end):
            before, word = best[begin], piece[begin:end]
            if before is None or word not in words:
                continue
            if len(word) == 1 and word.isascii() and not (len(piece) == 1 or begin == 0 or end == len(piece)):
                continue
            if shortest is None or len(before) + 1 < len(shortest):
                shortest = [*before, word]
        best.append(shortest)
    return best[-1]
