"""Write VRM animations (.vrma): expressions that every avatar has, the gaze, and turns of the head.

The layout is that of the extension VRMC_vrm_animation 1.0: the weight of an expression is the x of its node's
translation, and bones rest in a T-pose without rotations of their own.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from fba.animation import Animation
from fba.arrays import Float64
from fba.capture import to_blendshapes
from fba.gltf import Builder
from fba.source import Path, naming_file

EXTENSION = "VRMC_vrm_animation"
EXPRESSIONS = (
    "aa", "ih", "ou", "ee", "oh", "blinkLeft", "blinkRight", "happy", "angry", "sad", "surprised"
)  # fmt: skip
"""VRM's presets whose FAPs differ from each other; "relaxed" is a faint "happy"."""
BONE_HEIGHTS = {"hips": 0.95, "spine": 0.1, "chest": 0.15, "neck": 0.25, "head": 0.1}
"""Bones from the root to the head, and the height of each above the bone before, metres."""
EYES_ABOVE_HEAD = 0.06
"""Metres from the joint of the head up to the eyes."""


def sniff(head: bytes, suffix: str) -> bool:
    """Return False: VRM animations are read as glTF."""
    return False


def write(path: Path, animation: Animation) -> None:
    """Write the face as a VRM animation.

    Weights are those whose FAPs come closest, see `fba.capture.to_blendshapes`: lips and brows follow as far
    as vowels and moods can move them. Raises FormatError without a face.
    """
    with naming_file(path):
        motion = to_blendshapes(animation, EXPRESSIONS)
    builder = Builder()
    bones: dict[str, int] = {}
    for bone, above in BONE_HEIGHTS.items():
        bones[bone] = builder.add("nodes", {"name": bone, "translation": [0.0, above, 0.0]})
        if len(bones) > 1:
            builder.root["nodes"][bones[bone] - 1]["children"] = [bones[bone]]
    nodes = {name: builder.add("nodes", {"name": name}) for name in (*motion.names, "lookAt")}
    builder.root["scene"] = builder.add("scenes", {"nodes": [bones["hips"], *nodes.values()]})
    times = builder.data(motion.times.astype(np.float32), bounds=True)
    samplers: list[dict[str, int]] = []
    channels: list[dict[str, object]] = []

    def animate(node: int, what: str, values: Float64) -> None:
        channels.append({"sampler": len(samplers), "target": {"node": node, "path": what}})
        samplers.append({"input": times, "output": builder.data(values.astype(np.float32))})

    for column, name in enumerate(motion.names):
        animate(nodes[name], "translation", motion.weights[:, [column]] * [1.0, 0.0, 0.0])
    assert motion.eyes is not None  # `to_blendshapes` gives both
    assert motion.head is not None
    left_yaw, right_yaw, left_pitch, right_pitch = motion.eyes.T
    yaw, pitch = (left_yaw + right_yaw) / 2, (left_pitch + right_pitch) / 2
    animate(nodes["lookAt"], "rotation", Rotation.from_euler("YX", np.stack([yaw, pitch], axis=1)).as_quat())
    turned = Rotation.from_euler("YZX", motion.head[:, [1, 2, 0]])
    animate(bones["head"], "rotation", turned.as_quat())
    name = animation.name or "face"
    builder.add("animations", {"name": name, "samplers": samplers, "channels": channels})
    builder.root["extensionsUsed"] = [EXTENSION]
    builder.root["extensions"] = {
        EXTENSION: {
            "specVersion": "1.0",
            "humanoid": {"humanBones": {bone: {"node": node} for bone, node in bones.items()}},
            "expressions": {"preset": {name: {"node": nodes[name]} for name in motion.names}},
            "lookAt": {"node": nodes["lookAt"], "offsetFromHeadBone": [0.0, EYES_ABOVE_HEAD, 0.0]},
        }
    }
    builder.save(path)
