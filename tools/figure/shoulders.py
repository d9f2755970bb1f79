"""Corrects the shoulders for hanging arms, as in the standard's default posture.

The figure is modelled with its arms away from the body. With the arms down, the cap of the shoulder would
stick out as a corner beside the joint; a person's slopes from the neck into the arm. The cap is moved in
there, and the correction transformed back into the modelled posture.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import rig
from person import Person

Float64 = npt.NDArray[np.float64]

CAP = (-0.11, 0.05)
"""Heights from the joint over which moving in the cap fades in, metres."""
LEFT = 0.45
"""Share that remains of its distance beyond SIDE, at the upper of these heights."""
SIDE = -0.010
"""Metres out from the joint from which that distance is measured."""


def slope_shoulders(person: Person, bones: rig.Rig) -> Person:
    """The person with the caps of both shoulders moved in."""
    hanging = _default_posture(bones)
    turned = np.einsum("vj,jab->vab", bones.weights, hanging)
    places = np.einsum("vab,vb->va", turned, np.pad(person.vertices, ((0, 0), (0, 1)), constant_values=1.0))
    shift = np.zeros_like(places[:, :3])
    for side, sign in (("l", 1.0), ("r", -1.0)):
        joint = bones.centres[bones.names.index(f"{side}_shoulder")]
        out = sign * (places[:, 0] - joint[0]) - SIDE
        high = _smooth((places[:, 1] - joint[1] - CAP[0]) / (CAP[1] - CAP[0]))
        shift[:, 0] -= sign * np.maximum(out, 0.0) * (1 - LEFT) * high
    back = np.einsum("vab,va->vb", turned[:, :3, :3], shift)  # by the inverse rotations
    return replace(person, vertices=person.vertices + back)


def _default_posture(bones: rig.Rig) -> Float64:
    """(J, 4, 4) matrices from the posture of the figure to the default one."""
    upright = np.tile(np.eye(4), (len(bones.names), 1, 1))
    upright[:, :3, 3] = bones.centres
    return upright @ np.linalg.inv(bones.bind)


def _smooth(value: Float64) -> Float64:
    t = np.clip(value, 0.0, 1.0)
    return t * t * (3 - 2 * t)
