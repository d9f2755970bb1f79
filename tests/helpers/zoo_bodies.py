"""The default person in motion, written as BVH text in the conventions of many makers."""

import warnings
from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from fba.body import BapSolver, Skeleton, gait
from fba.body.footing import lowest_sole
from fba.parameters import bap_numbers, baps

Float64 = npt.NDArray[np.float64]
FRAMES, RATE = 16, 15
SPINES = {
    1: ("vl3",),
    2: ("vl5", "vt10"),
    3: ("vl5", "vl1", "vt6"),
    4: ("vl5", "vl2", "vt12", "vt6"),
    5: ("vl5", "vl3", "vl1", "vt10", "vt6"),
    6: ("vl5", "vl3", "vl2", "vl1", "vt10", "vt6"),
    7: ("vl5", "vl4", "vl3", "vl1", "vt12", "vt10", "vt6"),
}
FINGERS = ("thumb", "index", "middle", "ring", "pinky")
UPS = {
    "y": np.eye(3),
    "z": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "x": np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
}
"""From y up to another axis up."""
ARMS = {"N": 0.0, "A": 45.0, "T": 90.0}
"""Degrees by which a rest pose raises the arms."""


@dataclass(frozen=True)
class Maker:
    """A convention.

    parts: names of hips, spine joints (space apart), neck, head, then of clavicle, upper arm, forearm, hand,
    thigh, shank, foot, toes, with {} for the side; "" for a joint that is missing. sides: words of left and
    right. rest: "T", "A", "N", "X" (all bones along +x) or "M" (the same, on the right side along -x). up:
    axis. unit: in metres. order: of the channels. finger: name of a finger's joint with {side}, {finger} and
    {number}, "" for none. twist: name of a joint in the middle of upper arm and thigh. extra: names of joints
    that hang on the hips. above: name of a joint above the hips; the path is in the hips' own channels.
    aside: degrees by which hips and chest are turned in motion, but not at rest; what hangs there is turned
    back.
    """

    name: str
    parts: tuple[str, ...]
    sides: tuple[str, str] = ("Left", "Right")
    rest: str = "T"
    up: str = "y"
    unit: float = 0.01
    order: str = "ZXY"
    finger: str = ""
    fingers: tuple[str, ...] = ("Thumb", "Index", "Middle", "Ring", "Pinky")
    twist: str = ""
    extra: tuple[str, ...] = ()
    above: str = ""
    aside: float = 0.0


@cache
def truth() -> tuple[Float64, tuple[str, ...]]:
    """Matrices (T, J, 4, 4) of somebody who walks, looks around and moves their hands, and the joints."""
    walk = gait.walk(cycles=1, rate=RATE)
    values = np.array(walk.body.values[:FRAMES])
    for joint in ("sacroiliac", "subtalar", "midtarsal", "acromioclavicular", "sternoclavicular"):
        for bap in baps():  # joints that most makers lack stand still
            if joint in bap.joint:
                values[:, bap.number - 1] = 0
    wave = np.sin(np.linspace(0, 2 * np.pi, len(values)))
    for name, centre, swing in (
        ("skullbase_torsion", 0.0, 0.3), ("skullbase_tilt", 0.0, 0.1), ("vt6_torsion", 0.0, 0.08),
        ("l_elbow_flexion", 0.7, 0.4), ("r_elbow_flexion", 0.7, -0.4),
        ("l_wrist_flexion", 0.0, 0.2), ("r_wrist_flexion", 0.0, 0.2),
        ("l_index1_flexion", -0.2, 0.2), ("r_index1_flexion", -0.2, 0.2),
        ("l_middle1_flexion", -0.2, 0.2), ("r_middle1_flexion", -0.2, 0.2),
    ):  # fmt: skip
        values[:, bap_numbers()[name] - 1] = np.round((centre + swing * wave) * 1e5)
    skeleton = Skeleton.default()
    matrices = BapSolver(skeleton).pose(values)
    lowest = lowest_sole(skeleton, matrices)
    matrices[:, :, 1, 3] -= lowest[:, None]  # on the ground in all frames
    return matrices, skeleton.names


def _joints(maker: Maker) -> list[tuple[str, str, str]]:
    """Name, body joint and name of the parent, parents first; a "+" is before what the standard lacks."""
    hips, spine, neck, head, *sided = maker.parts
    rows = [(hips, "HumanoidRoot", "")]
    if maker.above:
        rows = [(maker.above, "+floor", ""), (hips, "HumanoidRoot", maker.above)]
    if maker.aside:
        rows += [(f"{word}HipJoint", "+back", hips) for word in ("Mid", *maker.sides)]
    last = "MidHipJoint" if maker.aside else hips
    for name, joint in zip(spine.split(), SPINES[len(spine.split())], strict=True):
        rows.append((name, joint, last))
        last = name
    if maker.aside:
        rows.append(("ChestJoint", "+back", last))
        last = "ChestJoint"
    chest = last
    for name, joint in ((neck, "vc7"), (head, "skullbase")):
        if name:
            rows.append((name, joint, last))
            last = name
    bodies = ("sternoclavicular", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "metatarsal")
    for word, side in zip(maker.sides, "lr", strict=True):
        last = chest
        for name, part in zip(sided, bodies, strict=True):
            if part == "hip":
                last = f"{word}HipJoint" if maker.aside else hips
            if not name:
                continue
            rows.append((name.format(word), f"{side}_{part}", last))
            last = name.format(word)
            if maker.twist and part in ("shoulder", "hip"):
                twisted = maker.twist.format(last)
                rows.append((twisted, f"+{side}_{part}", last))
                last = twisted
            if part == "wrist" and maker.finger:
                for finger, named in zip(FINGERS, maker.fingers, strict=True):
                    above = last
                    for number in (1, 2, 3):
                        own = maker.finger.format(side=word, finger=named, number=number)
                        rows.append((own, f"{side}_{finger}{number}", above))
                        above = own
    rows += [(name, "+beside", hips) for name in maker.extra]
    return rows


def _axes(maker: Maker, joint: str, aim: Float64 | None) -> Float64:
    """A joint's own axes in the default posture, as columns. aim: unit, to the next joint."""
    side = 1.0 if joint.lstrip("+").startswith("l_") else -1.0
    arm = any(part in joint for part in ("shoulder", "elbow", "wrist", *FINGERS))
    if maker.rest in ARMS:
        raised = np.radians(ARMS[maker.rest]) * (side if arm else 0.0)
        rest = Rotation.from_euler("z", raised)
        if arm and raised and aim is not None:  # arms of a T are straight: from straight down, to the side
            rest *= Rotation.align_vectors([[0.0, -1.0, 0.0]], [aim])[0]
        return rest.inv().as_matrix()
    if aim is None or joint in ("HumanoidRoot", "skullbase") or joint.startswith("v"):
        aim = np.array([0.0, 1.0, 0.0])
    across = np.array([1.0, 0.0, 0.0])
    if "sternoclavicular" in joint or (abs(aim @ across) > 0.9):
        across = np.array([0.0, 0.0, 1.0])
    along = -aim if maker.rest == "M" and side < 0 and "_" in joint else aim
    across = across - along * (across @ along)
    across /= np.linalg.norm(across)
    return np.stack([along, np.cross(across, along), across], axis=1)


def write(maker: Maker) -> tuple[str, dict[str, str]]:
    """BVH text of the person in motion, and name -> body joint of the joints that the standard has."""
    matrices, names = truth()
    skeleton = Skeleton.default()
    number = {name: n for n, name in enumerate(names)}
    up = UPS[maker.up]
    rows = _joints(maker)
    row_of = {name: n for n, (name, _, _) in enumerate(rows)}
    centres, turned, axes = [], [], []
    for n, (name, joint, parent) in enumerate(rows):
        plain = joint.lstrip("+")
        under = [name, *(other for other, j, above in rows if above == name and j == f"+{joint}")]
        children = [j for _, j, above in rows if above in under and j in number]
        if joint == "+floor":
            centres.append(np.zeros(3))
            turned.append(np.tile(np.eye(3), (len(matrices), 1, 1)))
            axes.append(np.eye(3))
            continue
        if joint == "+beside":
            centres.append(centres[row_of[parent]] + [0.0, 0.1, 0.1])
            turned.append(turned[row_of[parent]])
            axes.append(axes[row_of[parent]])
            continue
        if joint == "+back":
            above = row_of[parent]
            centres.append(centres[above])
            turned.append(matrices[:, number[rows[above][1]], :3, :3])
            axes.append(axes[above])
            continue
        centre = skeleton.centres[number[plain]]
        if joint.startswith("+"):  # a twist bone: in the middle, it turns with the bone
            below = {"shoulder": "elbow", "hip": "knee"}[plain[2:]]
            centre = (centre + skeleton.centres[number[f"{plain[0]}_{below}"]]) / 2
            children = [f"{plain[0]}_{below}"]
        line = skeleton.centres[number[children[0]]] - centre if children else None
        if plain.endswith("wrist"):
            middle = skeleton.centres[number[f"{plain[0]}_middle1"]] - centre
            line = middle
        aim = None if line is None or np.linalg.norm(line) == 0 else line / np.linalg.norm(line)
        if aim is None and n:
            aim = np.array([0.0, 0.0, 1.0]) if "metatarsal" in joint else None
        if aim is None and "_" in joint and parent:  # the last bone of a finger, or a hand
            aim = axes[row_of[parent]][:, 0] if maker.rest in "XM" else np.array([0.0, -1.0, 0.0])
        centres.append(centre)
        backed = any(above == name and other == "+back" for _, other, above in rows)
        aside = np.radians(maker.aside) if backed else 0.0
        turned.append(matrices[:, number[plain], :3, :3] @ Rotation.from_euler("y", aside).as_matrix())
        axes.append(_axes(maker, joint, aim))
    text = ["HIERARCHY"]
    columns: list[Float64] = []

    def enter(n: int, depth: int) -> None:
        name, joint, parent = rows[n]
        pad = "\t" * depth
        above = row_of[parent] if parent else -1
        place = centres[n] if above < 0 else axes[above].T @ (centres[n] - centres[above])
        local = up @ place / maker.unit
        path = joint == "HumanoidRoot"
        text.append(f"{pad}{'JOINT' if parent else 'ROOT'} {name}")
        text.append(f"{pad}{{")
        text.append(f"{pad}\tOFFSET {local[0]:.6f} {local[1]:.6f} {local[2]:.6f}")
        channels = [f"{axis}rotation" for axis in maker.order]
        if path or not parent:
            channels = ["Xposition", "Yposition", "Zposition", *channels]
            moving = matrices[:, 0, :3, 3] if path else np.zeros((len(matrices), 3))
            columns.extend((moving @ up.T / maker.unit).T)
        text.append(f"{pad}\tCHANNELS {len(channels)} {' '.join(channels)}")
        own = up @ turned[n] @ axes[n] @ up.T
        local_turn = own if above < 0 else np.swapaxes(up @ turned[above] @ axes[above] @ up.T, 1, 2) @ own
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Gimbal lock", UserWarning)  # any of the angles will do
            columns.extend(Rotation.from_matrix(local_turn).as_euler(maker.order, degrees=True).T)
        children = [m for m, row in enumerate(rows) if row[2] == name]
        for child in children:
            enter(child, depth + 1)
        if not children:
            text.append(f"{pad}\tEnd Site\n{pad}\t{{\n{pad}\t\tOFFSET 0 0 0\n{pad}\t}}")
        text.append(f"{pad}}}")

    enter(0, 0)
    text += ["MOTION", f"Frames: {len(matrices)}", f"Frame Time: {1 / RATE:.8f}"]
    text += [" ".join(f"{value:.6f}" for value in row) for row in np.array(columns).T]
    return "\n".join(text) + "\n", {name: joint for name, joint, _ in rows if not joint.startswith("+")}
