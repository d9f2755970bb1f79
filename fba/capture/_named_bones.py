"""Find the bones of a skeleton from the words in the names of its joints, and from their hierarchy.

A word such as "shoulder" or "leg" means different joints in different files. So each limb is matched as a
whole: all assignments of its parts to joints, in order from the trunk, are scored by the words and by the
lengths of bones, and the best counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, pairwise

import numpy as np

from fba.arrays import Float64, Int64
from fba.body import ROOT, Skeleton
from fba.capture._bone_words import Meaning, read
from fba.capture._spine import heights as spine_heights
from fba.capture._spine import joints as spine_joints
from fba.capture.motion import SkeletonMotion

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
    names, parents = motion.names, motion.parents
    meanings = [read(name) for name in names]
    lengths = np.linalg.norm(motion.offsets, axis=1)
    mapped: dict[str, int] = {}
    for side in "lr":
        for limb, parts in LIMBS.items():
            mapped |= _limb(side, limb, parts, meanings, parents, lengths)
    if not any(f"{side}_shoulder" in mapped for side in "lr") and _has_four_legs(mapped, meanings, parents):
        return {}
    if not all(f"{side}_{joint}" in mapped for side in "lr" for joint in ("hip", "knee", "ankle")):
        return {}
    hips = _common(_path(parents, mapped["l_hip"])[:-1], _path(parents, mapped["r_hip"])[:-1])
    if hips is None:
        return {}
    head = next(
        (n for n, m in enumerate(meanings) if "head" in m.parts and not m.side and not m.helper), hips
    )
    trunk = _common(_path(parents, hips), _path(parents, head))
    if trunk is not None and trunk != hips:  # DAZ: legs and back hang on a joint above the pelvis
        mapped["sacroiliac"], hips = hips, trunk
    mapped[ROOT] = hips
    for side in "lr":
        mapped |= _toe(side, mapped, meanings, motion)
        mapped |= _clavicle(side, mapped, meanings, parents)
        if f"{side}_wrist" in mapped:
            mapped |= _fingers(side, motion.descendants(mapped[f"{side}_wrist"]), names, meanings, parents)
    mapped |= _spine(mapped, meanings, motion, lengths, skeleton)
    return {joint: number for joint, number in mapped.items() if joint in skeleton}


def _path(parents: Int64, joint: int) -> list[int]:
    """Return the joints from the root down to a joint."""
    path = [joint]
    while (joint := int(parents[joint])) >= 0:
        path.append(joint)
    return path[::-1]


def _common(first: list[int], second: list[int]) -> int | None:
    """Return the last joint that two paths from the root share."""
    shared = [a for a, b in zip(first, second, strict=False) if a == b]
    return shared[-1] if shared else None


def _limb(
    side: str, limb: str, parts: Sequence[tuple[str, str]], meanings: Sequence[Meaning], parents: Int64,
    lengths: Float64,
) -> dict[str, int]:  # fmt: skip
    """Return the three joints of a limb; empty if no joints are likely to be it."""
    words = {part for part, _ in parts}
    other_words = {part for key, value in LIMBS.items() if key != limb for part, _ in value}
    best: tuple[float, tuple[int, ...]] = (-np.inf, ())
    ends = [
        number
        for number, meaning in enumerate(meanings)
        if meaning.side == side and parts[2][0] in meaning.parts and not meaning.helper
    ]
    for end in ends[:MAX_ENDS]:
        path = _path(parents, end)
        chain = [
            number
            for number in path
            if meanings[number].side in (side, "") and not other_words & _certain(meanings[number])
        ][-MAX_CHAIN:]
        chain = [
            number
            for number in chain
            if meanings[number].side == side or meanings[number].parts.keys() & words
        ]
        reach = dict(zip(path, np.cumsum(lengths[path]).tolist(), strict=True))
        for three in combinations(chain, 3):
            score = sum(
                _score(meanings[number], part, side) for number, (part, _) in zip(three, parts, strict=True)
            )
            bones = [reach[b] - reach[a] for a, b in pairwise(three)]
            if min(bones) < MIN_LENGTH_RATIO * max(bones):
                score -= 2
            score += 0.01 * (three[0] - end) / max(len(parents), 1)  # of two hips, the closer to the knee
            if score > best[0]:
                best = (score, three)
    if best[0] < 3:
        return {} if ends else _numbered_limb(side, limb, meanings, parents)
    return {f"{side}_{joint}": number for number, (_, joint) in zip(best[1], parts, strict=True)}


def _numbered_limb(side: str, limb: str, meanings: Sequence[Meaning], parents: Int64) -> dict[str, int]:
    """Return the joints of a limb that differ by numbers only, "leg_joint_L_1" to 3 from the trunk.

    The fourth of a leg is that of the toes. Empty for several such limbs, as of animals.
    """
    words = {part for part, _ in LIMBS[limb]}
    named = {
        number
        for number, meaning in enumerate(meanings)
        if meaning.side == side and meaning.parts.keys() & words and not meaning.helper
    }
    chains = [[number] for number in sorted(named) if int(parents[number]) not in named]
    if len(chains) != 1:
        return {}
    chain = chains[0]
    while len(below := [n for n in np.flatnonzero(parents == chain[-1]).tolist() if n in named]) == 1:
        chain.append(below[0])
    joints = [f"{side}_{joint}" for _, joint in LIMBS[limb]]
    if limb == "leg":
        joints.append(f"{side}_metatarsal")
    return dict(zip(joints, chain, strict=False)) if len(chain) >= len(LIMBS[limb]) else {}


def _has_four_legs(mapped: dict[str, int], meanings: Sequence[Meaning], parents: Int64) -> bool:
    """Whether each side has a leg beside the mapped leg, as animals have."""
    legs = [part for part, _ in LIMBS["leg"]]
    for side in "lr":
        leg = {mapped.get(f"{side}_{joint}") for joint in ("hip", "knee", "ankle")}
        others = {
            part
            for number, meaning in enumerate(meanings)
            if meaning.side == side and not meaning.helper and leg.isdisjoint(_path(parents, number))
            for part in legs
            if part in meaning.parts
        }
        if len(others) < len(legs):
            return False
    return True


def _certain(meaning: Meaning) -> set[str]:
    return {part for part, value in meaning.parts.items() if value > 1}


def _score(meaning: Meaning, part: str, side: str) -> float:
    """Return how well a name agrees with a part of a limb: 2 if it names it, less if it names another."""
    value = float(meaning.parts.get(part, -1.5 if meaning.parts else -0.5))
    if part in meaning.parts and len(_certain(meaning) - {part, "hips"}):
        value -= 1.0  # "LeftHandThumb1" is a thumb
    return value - HELPER_COST * meaning.helper - (0.5 if meaning.side != side else 0.0)


def _toe(
    side: str, mapped: dict[str, int], meanings: Sequence[Meaning], motion: SkeletonMotion
) -> dict[str, int]:
    """Return the joint of the toes: the highest below the ankle with that name; of several, the middle."""
    ankle, *below = motion.descendants(mapped[f"{side}_ankle"])
    depth = {ankle: 0}
    toes: list[int] = []
    for number in below:
        depth[number] = depth[int(motion.parents[number])] + 1
        if "toe" in meanings[number].parts and not meanings[number].helper:
            toes.append(number)
    if not toes:
        return {}
    sure = [t for t in toes if meanings[t].parts["toe"] > 1] or toes
    first = min(depth[t] for t in sure)
    level = [t for t in sure if depth[t] == first]
    return {f"{side}_metatarsal": level[(len(level) - 1) // 2]}


def _clavicle(
    side: str, mapped: dict[str, int], meanings: Sequence[Meaning], parents: Int64
) -> dict[str, int]:
    """Return the clavicle: the joint between trunk and upper arm with that name, or with the arm's side."""
    if f"{side}_shoulder" not in mapped:
        return {}
    above = [
        number
        for number in _path(parents, mapped[f"{side}_shoulder"])[:-1]
        if meanings[number].side == side and not meanings[number].helper
    ]
    named = [number for number in above if "clavicle" in meanings[number].parts]
    return {f"{side}_sternoclavicular": (named or above)[0]} if above else {}


def _fingers(
    side: str, hand: Sequence[int], names: Sequence[str], meanings: Sequence[Meaning], parents: Int64
) -> dict[str, int]:
    """Return three joints for each finger. hand: the wrist and all joints below it."""
    numbered = [m.numbers[0] for m in meanings if "finger" in m.parts and m.numbers]
    first = 0 if any(_digit(number) == 0 for number in numbered) else 1  # the thumb's
    chains: dict[str, list[int]] = {}
    for number in hand[1:]:
        meaning = meanings[number]
        named = [finger for finger in FINGERS if finger in meaning.parts]
        finger = next((f for f in named if f != "middle"), named[0] if named else None)  # "ring_mid"
        above = next((f for f, chain in chains.items() if int(parents[number]) in chain), None)
        if above is not None and (finger in (None, above)):
            finger = above
        elif finger is None and "finger" in meaning.parts and meaning.numbers:
            digit = meaning.numbers[0] if len(meaning.numbers) > 1 else _digit(meaning.numbers[0])
            finger = FINGERS[digit - first] if 0 <= digit - first < len(FINGERS) else None
        if finger is None or meaning.helper or (above is None and finger in chains):
            continue
        if "meta" in meaning.parts or "inhand" in names[number].lower():  # Rokoko: "LeftInHandIndex"
            continue
        chain = chains.setdefault(finger, [])
        if chain and _letters(names[chain[-1]]) == _letters(names[number]):
            chain[-1] = number  # DAZ: "__lthumb" above "lthumb" stands still
        else:
            chain.append(number)
    result = {}
    for finger, chain in chains.items():
        in_palm = len(chain) > 3 and not meanings[chain[0]].numbers and bool(meanings[chain[1]].numbers)
        start = 1 if in_palm else 0
        for position, number in enumerate(chain[start : start + 3], 1):
            result[f"{side}_{finger}{position}"] = number
    return result


def _letters(name: str) -> str:
    return "".join(filter(str.isalnum, name)).lower()


def _digit(number: int) -> int:
    """Return the first digit: Biped's fingers are 0, 01, 02, 1, 11, 12, ..."""
    return int(str(number)[0])


def _crown(top: int, meanings: Sequence[Meaning], parents: Int64) -> list[int]:
    """Return the joints of a neck and head without such names: the chain that rises between the arms.

    It begins above `top`, the joint that the arms hang on. Its joints have no side and are no helpers.
    """
    chain: list[int] = []
    joint = top
    while True:
        upwards = [
            number
            for number in np.flatnonzero(parents == joint).tolist()
            if not meanings[number].side and not meanings[number].helper
        ]
        if len(upwards) != 1:
            return chain if len(chain) > 1 else []
        joint = upwards[0]
        chain.append(joint)


def _spine(
    mapped: dict[str, int],
    meanings: Sequence[Meaning],
    motion: SkeletonMotion,
    lengths: Float64,
    skeleton: Skeleton,
) -> dict[str, int]:
    """Return the joints of back, neck and head, spread over the vertebrae by their heights on the spine."""
    hips, parents = mapped[ROOT], motion.parents
    limbs = set(mapped.values()) - {hips}
    middle = [
        number
        for number in motion.descendants(hips)[1:]
        if not meanings[number].side and not meanings[number].helper
    ]
    heads = [number for number in middle if "head" in meanings[number].parts]
    necks = [number for number in middle if "neck" in meanings[number].parts]
    result: dict[str, int] = {}
    arms = [mapped[f"{side}_shoulder"] for side in "lr" if f"{side}_shoulder" in mapped]
    if heads:
        top = heads[0]
        result["skullbase"] = top
    elif necks:
        top = necks[-1]
    elif len(arms) == 2:
        top = _common(_path(parents, arms[0]), _path(parents, arms[1])) or hips
        necks = _crown(top, meanings, parents)
        if necks:  # vertebrae by their numbers, up to the one that carries the head
            top = necks.pop()
            heads = [top]
            result["skullbase"] = top
    else:
        return {}
    path = _path(parents, top)
    if hips not in path:
        return result
    line = [number for number in path[path.index(hips) + 1 :] if number not in limbs]
    neck = [number for number in line if number in necks]
    neck = neck[:2] if len(neck) < 4 else [neck[0], neck[len(neck) // 2]]
    if neck:
        result["vc7"] = neck[0]
        if len(neck) > 1:
            result["vc4"] = neck[1]
    end = line.index(neck[0]) if neck and neck[0] in line else len(line) - (1 if heads else 0)
    return result | _vertebrae(line[:end], lengths[line[: end + 1]], skeleton)


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
