"""People who lie, crawl, swim, fly, hang, fall, sit and stand, as skeletons of any axis up."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from capture_bodies import motion, source_places
from fba.capture import SkeletonMotion

RATE, FRAMES = 30, 90
TIME = np.arange(FRAMES) / RATE
SWING = np.sin(2 * np.pi * TIME / 1.5)
"""Of limbs that go to and fro."""
SIDES = (("Left", 1.0), ("Right", -1.0))
UPS = {
    "+y": Rotation.identity(),
    "+z": Rotation.from_euler("x", 90, degrees=True),
    "+x": Rotation.from_euler("z", -90, degrees=True),
    "-y": Rotation.from_euler("x", 180, degrees=True),
    "-z": Rotation.from_euler("x", -90, degrees=True),
}
"""From y up to another axis up."""

Turns = dict[str, Rotation]


def about(axis: str, degrees: float | np.ndarray) -> Rotation:
    return Rotation.from_rotvec(
        np.outer(np.broadcast_to(degrees, FRAMES), np.eye(3)["xyz".index(axis)]), degrees=True
    )


def limbs(arm: float, elbow: float, thigh: float, knee: float, swing: float = 0.0) -> Turns:
    """Turns about x in degrees, negative ahead; arms and thighs swing against each other."""
    turns = {}
    for side, sign in SIDES:
        turns[f"{side}Arm"] = about("x", arm + sign * swing * SWING)
        turns[f"{side}ForeArm"] = about("x", elbow)
        turns[f"{side}UpLeg"] = about("x", thigh - 1.33 * sign * swing * SWING)
        turns[f"{side}Leg"] = about("x", knee)
    return turns


def _made(turns: Turns, heights: np.ndarray | None = None, path: np.ndarray | None = None,
          firm: tuple[str, str] | None = None) -> SkeletonMotion:  # fmt: skip
    """heights: of the lowest joint, 0 if None. path: (T, 3) of the root. firm: joints that bear in turns."""
    made = replace(motion("standing", FRAMES, turns=turns, rate=RATE), positions=np.zeros((FRAMES, 3)))
    places = source_places(made)
    root = np.zeros((FRAMES, 3)) if path is None else np.array(path)
    if firm is not None:  # the body goes as the joint that bears goes back
        bearing = np.where(np.diff(SWING, prepend=-0.1) > 0, *(made.names.index(name) for name in firm))
        moves = [places[t, bearing[t]] - places[t - 1, bearing[t]] for t in range(1, FRAMES)]
        root[1:] -= np.cumsum(moves, axis=0) * [1, 0, 1]
    root[:, 1] += (0.0 if heights is None else heights) - (places[..., 1].min(axis=1))
    return replace(made, positions=root)


def _hips(*turns: Rotation) -> Turns:
    whole = turns[0]
    for turn in turns[1:]:
        whole = turn * whole
    return {"Hips": whole}


def walks() -> SkeletonMotion:
    return _made(limbs(0, -10, 0, 5, 18), firm=("RightFoot", "LeftFoot"))


def lies() -> SkeletonMotion:
    """On the back; breathes, and lifts an arm."""
    return _made(_hips(about("x", -90)) | {"LeftArm": about("x", -40 + 40 * SWING),
                                           "Spine": about("x", SWING)})  # fmt: skip


def lies_on_a_side() -> SkeletonMotion:
    return _made(_hips(about("z", 90)) | limbs(-30, -40, -30, 50))


def rolls() -> SkeletonMotion:
    """Along the floor, over back and belly."""
    turned = np.linspace(0, 360, FRAMES)
    path = np.outer(np.radians(turned) * 0.15, [1.0, 0, 0])
    return _made(_hips(about("y", turned), about("x", -90)), path=path)


def crawls() -> SkeletonMotion:
    return _made(_hips(about("x", 90)) | limbs(-90, 0, -90, 90, 15), firm=("RightHand", "LeftHand"))


def swims() -> SkeletonMotion:
    """In deep water, at 1 m/s, with a bobbing body."""
    strokes = {f"{side}Arm": about("x", -360 * TIME + 90 * sign) for side, sign in SIDES}
    kicks = {f"{side}UpLeg": about("x", 15 * sign * np.sin(20 * TIME)) for side, sign in SIDES}
    return _made(_hips(about("x", 90)) | strokes | kicks, 1.0 + 0.05 * SWING, np.outer(TIME, [0, 0, 1.0]))


def flies() -> SkeletonMotion:
    """Stretched, arms ahead, up and down and round a corner."""
    path = np.stack([2 * TIME**2, 0 * TIME, 4 * TIME], axis=1)
    return _made(_hips(about("x", 90)) | limbs(-180, 0, 5, 0), 3 + SWING, path)


def walks_on_hands() -> SkeletonMotion:
    return _made(_hips(about("x", 180)) | limbs(-180, 0, 10, 30, 12), firm=("RightHand", "LeftHand"))


def stands_on_hands() -> SkeletonMotion:
    return _made(_hips(about("x", 180)) | limbs(-180, 0, 0, 0) | {"LeftLeg": about("x", 20 + 20 * SWING)})


def falls() -> SkeletonMotion:
    """Stands, topples over backwards, and lies."""
    tilt = np.clip((TIME - 0.3) * 180, 0, 90)
    path = np.stack([0 * TIME, 0 * TIME, -0.9 * np.sin(np.radians(tilt))], axis=1)
    return _made(_hips(about("x", -tilt)), path=path)


def climbs() -> SkeletonMotion:
    return _made(limbs(-150, -20, -40, 60, 20), np.maximum.accumulate(0.3 * TIME + 0.05 * SWING))


def sits() -> SkeletonMotion:
    return _made(limbs(-20, -60, -90, 90) | {"Spine": about("y", 10 * SWING)})


def spins_on_the_back() -> SkeletonMotion:
    """As in breakdance, with the legs in the air."""
    turned = _hips(about("x", -80), about("y", 300 * TIME))
    return _made(turned | limbs(-30, -60, -70, 60, 20))


def dances() -> SkeletonMotion:
    turned = _hips(about("y", 200 * TIME), about("z", 15 * SWING))
    return _made(turned | limbs(-60, -70, -20, 40, 30), 0.1 * np.maximum(SWING, 0))


POSTURES: Mapping[str, Callable[[], SkeletonMotion]] = {
    made.__name__: made
    for made in (
        walks, lies, lies_on_a_side, rolls, crawls, swims, flies, walks_on_hands, stands_on_hands, falls,
        climbs, sits, spins_on_the_back, dances,
    )
}  # fmt: skip


def turned(made: SkeletonMotion, world: Rotation) -> SkeletonMotion:
    """The same person in other axes of the world; the rest pose with them."""
    quaternions = [
        (world * Rotation.from_quat(np.array(made.rotations[:, joint, [1, 2, 3, 0]])) * world.inv()).as_quat()
        for joint in range(len(made.names))
    ]
    return replace(
        made,
        offsets=world.apply(np.array(made.offsets)),
        rotations=np.stack(quaternions, axis=1)[..., [3, 0, 1, 2]],
        positions=world.apply(np.array(made.positions)),
    )


def turned_by_the_root(made: SkeletonMotion, world: Rotation) -> SkeletonMotion:
    """The same in other axes, by turns of the root alone; the rest pose stays as it was."""
    rotations = np.array(made.rotations)
    rotations[:, 0] = (world * Rotation.from_quat(rotations[:, 0, [1, 2, 3, 0]])).as_quat()[:, [3, 0, 1, 2]]
    return replace(made, rotations=rotations, positions=world.apply(np.array(made.positions)))


def along_x(made: SkeletonMotion) -> SkeletonMotion:
    """The same, where each bone has axes of its own, and lies along their x."""
    children = {int(parent): joint for joint, parent in reversed(list(enumerate(made.parents)))}
    own = []
    for joint, parent in enumerate(made.parents):
        line = made.offsets[children[joint]] if joint in children else np.zeros(3)
        if np.linalg.norm(line) > 0:
            own.append(Rotation.align_vectors([line / np.linalg.norm(line)], [[1.0, 0, 0]])[0])
        else:
            own.append(own[parent])
    rotations, offsets = np.array(made.rotations), np.array(made.offsets)
    for joint, parent in enumerate(made.parents):
        above = Rotation.identity() if parent < 0 else own[parent]
        turn = Rotation.from_quat(np.array(made.rotations[:, joint, [1, 2, 3, 0]]))
        rotations[:, joint] = (above.inv() * turn * own[joint]).as_quat()[:, [3, 0, 1, 2]]
        offsets[joint] = above.inv().apply(np.array(made.offsets[joint]))
    return replace(made, rotations=rotations, offsets=offsets)
