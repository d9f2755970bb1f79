"""Small captured bodies for the tests of motion capture, and an independent check of bone directions."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from fba.body import BapSolver, Skeleton
from fba.capture import SkeletonMotion

ARM = 0.3
LEG = 0.45


def joints(rest: str) -> dict[str, tuple[str | None, tuple[float, float, float]]]:
    """A person in metres with T-pose, A-pose or standing arms: name -> (parent, offset)."""
    reach = {"T": (1.0, 0.0), "A": (0.7071, -0.7071), "standing": (0.0, -1.0)}[rest]
    result: dict[str, tuple[str | None, tuple[float, float, float]]] = {
        "Hips": (None, (0.0, 0.0, 0.0)),
        "Spine": ("Hips", (0.0, 0.1, 0.0)),
        "Spine1": ("Spine", (0.0, 0.15, 0.0)),
        "Neck": ("Spine1", (0.0, 0.25, 0.0)),
        "Head": ("Neck", (0.0, 0.1, 0.02)),
    }
    for side, x in (("Left", 1.0), ("Right", -1.0)):
        arm = (x * ARM * reach[0], ARM * reach[1], 0.0)
        result |= {
            f"{side}Shoulder": ("Spine1", (x * 0.05, 0.2, 0.0)),
            f"{side}Arm": (f"{side}Shoulder", (x * 0.13, 0.0, 0.0)),
            f"{side}ForeArm": (f"{side}Arm", arm),
            f"{side}Hand": (f"{side}ForeArm", arm),
            f"{side}UpLeg": ("Hips", (x * 0.1, -0.05, 0.0)),
            f"{side}Leg": (f"{side}UpLeg", (0.0, -LEG, 0.0)),
            f"{side}Foot": (f"{side}Leg", (0.0, -LEG, 0.0)),
            f"{side}ToeBase": (f"{side}Foot", (0.0, -0.07, 0.14)),
        }
    return result


def motion(
    rest: str = "T",
    frames: int = 1,
    *,
    turns: dict[str, Rotation] | None = None,
    rate: Fraction | int = 60,
    scale: float = 1.0,
    prefix: str = "",
    world: Rotation | None = None,
) -> SkeletonMotion:
    """turns: Rotation of one or of `frames` frames, per joint. world: another frame for the whole source."""
    table = joints(rest)
    names = list(table)
    world = world or Rotation.identity()
    quaternions = np.zeros((frames, len(names), 4))
    quaternions[:, :, 0] = 1.0
    for name, turn in (turns or {}).items():
        seen = (world * turn * world.inv()).as_quat()
        quaternions[:, names.index(name)] = np.broadcast_to(seen, (frames, 4))[:, [3, 0, 1, 2]]
    return SkeletonMotion(
        names=tuple(prefix + name for name in names),
        parents=np.array([-1 if (p := table[n][0]) is None else names.index(p) for n in names]),
        offsets=world.apply(np.array([table[n][1] for n in names])) * scale,
        rotations=quaternions,
        positions=np.tile(world.apply([0.0, 1.0, 0.0]) * scale, (frames, 1)),
        rate=Fraction(rate),
    )


def swinging_limbs(frames: int = 12) -> SkeletonMotion:
    """Someone whose elbow and knee bend from a right angle to a little beyond straight, leaning sideways."""
    bend = np.radians(np.linspace(90, -8, frames))
    lean = np.radians(5) * np.sin(np.linspace(0, 2 * np.pi, frames))
    turns = {
        "LeftForeArm": Rotation.from_rotvec(np.stack([-bend, 0 * bend, lean], axis=1)),
        "RightLeg": Rotation.from_rotvec(np.stack([bend, 0 * bend, -lean], axis=1)),
    }
    return motion("standing", frames, turns=turns)


def source_places(captured: SkeletonMotion) -> np.ndarray:
    """(T, J, 3): forward kinematics by scipy, independent of the package's own."""
    places = np.zeros((len(captured), len(captured.names), 3))
    turned: list[Rotation] = []
    for joint, parent in enumerate(captured.parents):
        own = Rotation.from_quat(np.array(captured.rotations[:, joint])[:, [1, 2, 3, 0]])
        if parent < 0:
            turned.append(own)
            places[:, joint] = captured.positions
        else:
            turned.append(turned[parent] * own)
            places[:, joint] = places[:, parent] + turned[parent].apply(np.array(captured.offsets[joint]))
    return places


def bone_errors(
    captured: SkeletonMotion, values: np.ndarray, bones: dict[tuple[str, str], tuple[str, str]]
) -> dict[tuple[str, str], np.ndarray]:
    """Degrees (T,) between source bone and result. bones: body joints -> source joints, by name."""
    places, matrices = source_places(captured), BapSolver().pose(values)
    number = Skeleton.default().number
    errors = {}
    for (a, b), (c, d) in bones.items():
        ours = matrices[:, number(b), :3, 3] - matrices[:, number(a), :3, 3]
        theirs = places[:, captured.names.index(d)] - places[:, captured.names.index(c)]
        ours /= np.linalg.norm(ours, axis=1, keepdims=True)
        theirs /= np.linalg.norm(theirs, axis=1, keepdims=True)
        errors[a, b] = np.degrees(2 * np.arcsin(np.linalg.norm(ours - theirs, axis=1) / 2))
    return errors


def limb_bones(names: dict[str, str]) -> dict[tuple[str, str], tuple[str, str]]:
    """Bones between joints of names (body joint -> source joint) that follow each other in a chain.

    Not clavicles and feet: they count from where they rest, see tests/capture/test_rest_poses.py.
    """
    spine = ["HumanoidRoot", "vl5", "vl3", "vl2", "vl1", "vt12", "vt10", "vt6", "vc7", "vc4", "skullbase"]
    chains = [spine]
    for side in "lr":
        chains.append([f"{side}_{j}" for j in ("shoulder", "elbow", "wrist")])
        chains.append([f"{side}_{j}" for j in ("hip", "knee", "ankle")])
    bones = {}
    for chain in chains:
        present = [joint for joint in chain if joint in names]
        for a, b in pairwise(present):
            bones[a, b] = (names[a], names[b])
    return bones
