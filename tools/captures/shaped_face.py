"""A face as telephones and trackers describe it: weights of ARKit's shapes, action units, turns."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import fba
from fba.animation import Animation
from fba.arrays import Float64
from fba.capture import ActionUnitMotion, ShapeMotion, from_action_units, from_blendshapes
from fba.rotations import axis_matrices
from fba.sampling import find_rate
from tools.captures import face_files

SIZES = {
    "Blink": 1.0,
    "Look": 0.0,
    "JawOpen": 0.5,
    "MouthClose": 0.2,
    "Jaw": 0.15,
    "Mouth": 0.35,
    "Tongue": 0.0,
}
"""Largest weights of shapes by words of their names; of others, 0.4. Gaze comes from the eyes' angles."""
UNITS = (1, 2, 4, 5, 6, 7, 9, 10, 12, 14, 15, 17, 20, 23, 25, 26, 45)
"""Action units that OpenFace 2 gives."""
UNITS_3 = {1: 1, 2: 6, 3: 12, 4: 15, 5: 17, 6: 2, 7: 9, 8: 10}
"""Numbers in the columns of OpenFace 3, and the action units that they mean."""
FRAMES = 30.0
"""Frames a second of films that trackers see."""

TO_CAMERA = np.diag([1.0, -1.0, -1.0])
"""From left, up, front of a face that looks into a camera to right, down, away in its picture."""


def weights_at(times: Float64, seed: int = 3) -> dict[str, Float64]:
    """Return weights (T,) of the 52 shapes of a face that talks and blinks, by Live Link Face's names."""
    random = np.random.default_rng(seed)
    result = {}
    for name in face_files.UDP_ORDER:
        rate, phase = random.uniform(0.2, 1.5), random.uniform(0, 2 * np.pi)
        size = next((size for word, size in SIZES.items() if word in name), 0.4)
        wave = 0.5 + 0.5 * np.sin(2 * np.pi * rate * times + phase)
        if "Blink" in name:
            wave = np.maximum(0.0, np.sin(2 * np.pi * (0.2 * times + 0.3))) ** 24
        result[name] = size * wave
    return result


def units_at(times: Float64, seed: int = 4) -> dict[int, Float64]:
    """Return intensities (T,), 0 to 1, of action units of a face that talks."""
    random = np.random.default_rng(seed)
    rates, phases = random.uniform(0.2, 1.5, (2, 50))
    return {unit: 0.3 + 0.3 * np.sin(2 * np.pi * rates[unit] * times + 6 * phases[unit]) for unit in UNITS}


def turns_at(times: Float64) -> Float64:
    """Return pitch, yaw and roll of the head, and yaw and pitch of both eyes, radians (T, 5)."""
    rates, sizes = np.array([0.3, 0.2, 0.4, 0.5, 0.35]), np.array([0.15, 0.3, 0.1, 0.25, 0.15])
    return np.asarray(sizes * np.sin(2 * np.pi * rates * times[:, None]))


def columns_at(times: Float64) -> dict[str, Float64]:
    """Return the 61 columns of Live Link Face: heads turn left and up, eyes right and down."""
    pitch, yaw, roll, eye_yaw, eye_pitch = turns_at(times).T
    head = {"HeadYaw": yaw, "HeadPitch": -pitch, "HeadRoll": roll}
    none = np.zeros(len(times))
    eyes = {
        f"{side}Eye{turn}": value
        for side in ("Left", "Right")
        for turn, value in (("Yaw", -eye_yaw), ("Pitch", eye_pitch), ("Roll", none))
    }
    return {**weights_at(times), **head, **eyes}


def shapes_at(times: Float64, *, turned: bool = True) -> ShapeMotion:
    """Return the performance in the form of `fba.capture`. turned: with the turns of head and eyes."""
    weights = weights_at(times)
    head, eyes = _head_and_eyes(times) if turned else (None, None)
    names = tuple(face_files.camel(name) for name in weights)
    return ShapeMotion(
        names, np.stack(list(weights.values()), axis=1), times, find_rate(times), head=head, eyes=eyes
    )


def action_units_at(
    times: Float64, units: tuple[int, ...] = UNITS, *, turned: bool = True
) -> ActionUnitMotion:
    """Return action units that are performed, as `fba.capture` has them."""
    performed = units_at(times)
    head, eyes = _head_and_eyes(times) if turned else (None, None)
    strengths = np.stack([performed[unit] for unit in units], axis=1)
    return ActionUnitMotion(units, strengths, times, find_rate(times), head=head, eyes=eyes)


def _head_and_eyes(times: Float64) -> tuple[Float64, Float64]:
    turns = turns_at(times)
    return turns[:, :3], turns[:, [3, 3, 4, 4]]


def _livelink_csv(times: Float64) -> str:
    return face_files.livelink_csv(columns_at(times))


def _livelink_udp(times: Float64) -> bytes:
    return b"".join(face_files.livelink_udp(columns_at(times)))


def _ifacialmocap(times: Float64, version: int) -> str:
    degrees = np.degrees(turns_at(times))
    none = np.zeros(len(times))
    eye = np.stack([degrees[:, 4], degrees[:, 3], none], axis=1)
    head = np.hstack([degrees[:, :3], np.tile([0.0, 0.0, -0.5], (len(times), 1))])
    records = face_files.ifacialmocap_records(weights_at(times), head, np.hstack([eye, eye]), version=version)
    return "\n".join(records) + "\n"


def _mediapipe_json(times: Float64) -> str:
    return json.dumps(face_files.mediapipe_frames(weights_at(times), FRAMES))


def _mediapipe_csv(times: Float64) -> str:
    """A table of MediaPipe's scores: its own order, no tongue, milliseconds."""
    weights = {face_files.camel(name): values for name, values in weights_at(times).items()}
    names = sorted(set(weights) - {"tongueOut"})
    lines = [",".join(["frame", "time", "_neutral", *names])]
    for row, second in enumerate(times.tolist()):
        cells = [f"{weights[name][row]:.6f}" for name in names]
        lines.append(",".join([str(row), f"{second:.6f}", "0.000001", *cells]))
    return "\n".join(lines) + "\n"


def _beat(times: Float64) -> str:
    return json.dumps(face_files.beat(weights_at(times), 1 / float(times[1])))


def _openface(times: Float64, blank: str) -> str:
    pose, gaze = _as_seen(times)
    units = {unit: 5 * values for unit, values in units_at(times).items()}
    return face_files.openface_csv(units, pose, gaze, rate=FRAMES, blank=blank)


def _openface_3(times: Float64) -> str:
    pose, gaze = _as_seen(times)
    performed = units_at(times)
    units = {number: 5 * performed[unit] for number, unit in UNITS_3.items()}
    return face_files.openface_csv(units, pose, gaze, rate=FRAMES, blank="")


def _pyfeat(times: Float64) -> str:
    units = units_at(
        times
    )  # up to 0.6, which a probability of 1 stands for; closed eyes (43, 45) count in full
    likely = {unit: 0.5 + values / (2.0 if unit in (43, 45) else 1.2) for unit, values in units.items()}
    return face_files.pyfeat_csv(likely, frames=np.arange(float(len(times))))


def _as_seen(times: Float64) -> tuple[Float64, Float64]:
    """Return angles of the head, Rx Ry Rz (T, 3), and the gaze of both eyes (T, 6), in a camera's axes."""
    pitch, yaw, roll, eye_yaw, eye_pitch = turns_at(times).T
    head = axis_matrices(1, yaw) @ axis_matrices(2, roll) @ axis_matrices(0, pitch)
    seen = TO_CAMERA @ head @ TO_CAMERA
    looks = np.stack(
        [np.sin(eye_yaw) * np.cos(eye_pitch), -np.sin(eye_pitch), np.cos(eye_yaw) * np.cos(eye_pitch)], axis=1
    )
    gaze: Float64 = np.einsum("tij,tj->ti", TO_CAMERA @ head, looks)
    angles = Rotation.from_matrix(seen).as_euler("XYZ")
    both: Float64 = np.concatenate([gaze, gaze], axis=1)
    return np.asarray(angles, dtype=np.float64), both


@dataclass(frozen=True)
class FaceFile:
    """A kind of file.

    write: returns its content for the performance at given times. step: seconds between its rows. options: of
    `fba.read`. units: the action units in it; none where it has shapes. turned: it has the turns.
    """

    write: Callable[[Float64], bytes | str]
    step: float
    options: Mapping[str, Any] = field(default_factory=dict)
    units: tuple[int, ...] = ()
    turned: bool = True

    def times(self, seconds: float) -> Float64:
        """Return the times of its rows."""
        rows = np.arange(round(seconds / self.step), dtype=np.float64)
        return rows * self.step

    def truth(self, seconds: float, rate: Fraction) -> Animation:
        """Return the FAPs that are performed, at the times of the frames of a stream."""
        at = np.arange(round(seconds * float(rate))) / float(rate)
        if self.units:
            return from_action_units(action_units_at(at, self.units, turned=self.turned), rate)
        return from_blendshapes(shapes_at(at, turned=self.turned), rate)


AS_IT_IS = {"swap": "no"}
_APP, _FILM = face_files.STEP, 1 / FRAMES
FACE_FILES = {
    "livelink.csv": FaceFile(_livelink_csv, _APP, AS_IT_IS),
    "livelink.udp": FaceFile(_livelink_udp, _APP, AS_IT_IS),
    "ifacialmocap_1.txt": FaceFile(lambda times: _ifacialmocap(times, 1), 1 / 60),
    "ifacialmocap_2.txt": FaceFile(lambda times: _ifacialmocap(times, 2), 1 / 60),
    "mediapipe.json": FaceFile(_mediapipe_json, _FILM, turned=False),
    "mediapipe.csv": FaceFile(_mediapipe_csv, _FILM, turned=False),
    "beat.json": FaceFile(_beat, 1 / 60, turned=False),
    "openface_2.csv": FaceFile(lambda times: _openface(times, ""), _FILM, units=UNITS),
    "openface_2_windows.csv": FaceFile(lambda times: _openface(times, " "), _FILM, units=UNITS),
    "openface_3.csv": FaceFile(_openface_3, _FILM, units=tuple(UNITS_3.values())),
    "pyfeat.csv": FaceFile(_pyfeat, _FILM, {"source_rate": 30}, UNITS, turned=False),
}
"""Files by name, each in one way of one maker."""


def encode_file(folder: FilePath, name: str, seconds: float) -> tuple[Animation, Animation]:
    """Return the FAPs that `fba.read` makes of one of `FACE_FILES`, written to a folder, and the truth."""
    kind = FACE_FILES[name]
    content = kind.write(kind.times(seconds))
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    found = fba.read(path, **kind.options)
    return found, kind.truth(seconds, found.rate)
