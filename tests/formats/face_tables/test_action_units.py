"""Tables of OpenFace and py-feat, written from known intensities, poses and gazes: they come back."""

from pathlib import Path

import numpy as np
import pytest

import fba
from fba import rotations
from fba.arrays import Float64
from fba.capture import ActionUnitMotion, from_action_units, shape_faps
from fba.capture.blendshapes.conversion import unit_shapes
from fba.errors import FbaWarning, FormatError, ModelError
from fba.face import arkit_names
from fba.formats import format_of
from fba.formats.face_tables import _openface as openface
from fba.formats.face_tables import _pyfeat as pyfeat
from fba.parameters import fap_numbers
from format_files import saved
from tools.captures.face_files import openface_csv, pyfeat_csv

ROWS = 30
WAVE = 0.5 - 0.5 * np.cos(np.linspace(0, 6, ROWS))
UNITS = (1, 2, 4, 5, 6, 7, 9, 10, 12, 14, 15, 17, 20, 23, 25, 26, 45)
STRENGTHS = {unit: np.roll(WAVE, unit) for unit in UNITS}
OF_FIVE = {unit: 5 * values for unit, values in STRENGTHS.items()}
AHEAD = np.tile([0.0, 0.0, -1.0], (ROWS, 2))
STILL = np.zeros((ROWS, 3))


@pytest.mark.parametrize("blank", ["", " "])
def test_openface(tmp_path: Path, blank: str) -> None:
    path = saved(tmp_path, openface_csv(OF_FIVE, STILL, AHEAD, blank=blank))
    assert format_of(path).name == "openface"
    motion = openface.read_face(path)
    assert motion.units == UNITS
    assert motion.rate == 30
    np.testing.assert_allclose(motion.intensities, np.stack(list(STRENGTHS.values()), axis=1), atol=1e-5)
    np.testing.assert_allclose(motion.head, STILL, atol=1e-9)
    np.testing.assert_allclose(motion.eyes, np.zeros((ROWS, 4)), atol=1e-9)


@pytest.mark.parametrize(
    ("pose", "pitch", "yaw", "roll"),
    [((0.3, 0, 0), 0.3, 0, 0), ((0, 0.3, 0), 0, -0.3, 0), ((0, 0, 0.3), 0, 0, -0.3)],
)
def test_signs_of_poses(
    tmp_path: Path, pose: tuple[float, float, float], pitch: float, yaw: float, roll: float
) -> None:
    """A camera's y points down and its z away: turned about y, it looks to the right."""
    motion = openface.read_face(saved(tmp_path, openface_csv(OF_FIVE, STILL + pose, AHEAD)))
    assert motion.head is not None
    np.testing.assert_allclose(motion.head, np.tile([pitch, yaw, roll], (ROWS, 1)), atol=1e-6)


def test_large_poses_are_turned_in_the_order_of_faces(tmp_path: Path) -> None:
    pose = np.array([0.5, -0.7, 0.4])
    motion = openface.read_face(saved(tmp_path, openface_csv(OF_FIVE, STILL + pose, AHEAD)))
    pitch, yaw, roll = motion.head[0]
    x, y, z = (rotations.axis_matrices(axis, angle) for axis, angle in enumerate((pitch, yaw, roll)))
    camera = np.diag([1.0, -1.0, -1.0])
    expected = camera @ np.linalg.multi_dot(
        [rotations.axis_matrices(axis, angle) for axis, angle in enumerate(pose)]
    ) @ camera  # fmt: skip
    np.testing.assert_allclose(y @ z @ x, expected, atol=1e-5)


def test_gaze_is_relative_to_the_head(tmp_path: Path) -> None:
    """Both eyes look into the camera while the head is turned by 0.3 rad down: they look up in it."""
    motion = openface.read_face(saved(tmp_path, openface_csv(OF_FIVE, STILL + np.array([0.3, 0, 0]), AHEAD)))
    np.testing.assert_allclose(motion.eyes, np.tile([0, 0, -0.3, -0.3], (ROWS, 1)), atol=1e-6)
    aside = np.tile([0.2, 0.1, -1.0, 0.3, 0.0, -1.0], (ROWS, 1))  # eye 0 is the subject's right one
    motion = openface.read_face(saved(tmp_path, openface_csv(OF_FIVE, STILL, aside)))
    left_yaw, right_yaw, left_pitch, right_pitch = motion.eyes[0]
    assert left_yaw == pytest.approx(np.arctan(0.3), abs=1e-5)  # right in the picture is the subject's left
    assert right_yaw == pytest.approx(np.arctan(0.2), abs=1e-5)
    assert right_pitch > 0.09
    assert left_pitch == pytest.approx(0, abs=1e-6)


def test_rows_that_failed_and_doubtful_ones(tmp_path: Path) -> None:
    success, confidence = np.ones(ROWS), np.full(ROWS, 0.9)
    success[3], confidence[7:9] = 0, 0.2
    text = openface_csv(OF_FIVE, STILL, AHEAD, extra={"success": success, "confidence": confidence})
    path = saved(tmp_path, text)
    motion = openface.read_face(path)
    assert np.flatnonzero(np.isnan(motion.intensities).any(axis=1)).tolist() == [3, 7, 8]
    with pytest.warns(FbaWarning, match="3 of 30 rows have no face|frames are missing"):
        assert len(fba.read(path)) == ROWS


def test_columns_of_version_3(tmp_path: Path) -> None:
    eight = {number: np.full(ROWS, number / 2) for number in range(1, 9)}
    motion = openface.read_face(saved(tmp_path, openface_csv(eight, STILL, AHEAD)))
    found = dict(zip(motion.units, motion.intensities[0], strict=True))
    expected = {1: 0.1, 6: 0.2, 12: 0.3, 15: 0.4, 17: 0.5, 2: 0.6, 9: 0.7, 10: 0.8}
    assert found == pytest.approx(expected)
    assert "OpenFace 3" in motion.findings[0]


def test_several_faces(tmp_path: Path) -> None:
    both = openface_csv(OF_FIVE, STILL, AHEAD).splitlines()
    other = [line.replace(", 0,", ", 1,", 1) for line in both[1:]]
    rows = [row for pair in zip(both[1:], other, strict=True) for row in pair]
    path = saved(tmp_path, "\n".join([both[0], *rows[:-4]]))
    with pytest.raises(FormatError, match=r"has several faces: 0 \(28 rows\), 1 \(28 rows\); .*face='0'"):
        fba.read(path)
    assert len(openface.read_face(path, face="1")) == 28
    with pytest.raises(FormatError, match=r"has no face '7'; there are 0, 1"):
        fba.read(path, face="7")


def test_times_vary_or_are_those_of_pictures(tmp_path: Path) -> None:
    uneven = np.cumsum(np.where(np.arange(ROWS) % 7, 1 / 30, 2 / 30))
    path = saved(tmp_path, openface_csv(OF_FIVE, STILL, AHEAD, extra={"timestamp": uneven}))
    motion = openface.read_face(path)
    assert motion.rate == 30
    np.testing.assert_allclose(motion.times, uneven - uneven[0], atol=1e-5)
    path = saved(tmp_path, openface_csv(OF_FIVE, STILL, AHEAD, rate=1000))
    assert "taken as 30 in a second" in openface.read_face(path).findings[0]
    assert openface.read_face(path, source_rate=25).rate == 25


@pytest.mark.filterwarnings("ignore:.*rows have no face")
def test_damaged_tables_are_refused(tmp_path: Path) -> None:
    strong = {12: np.full(ROWS, 99.0), 1: WAVE}
    backwards, never = {"timestamp": -np.arange(ROWS)}, {"success": np.zeros(ROWS)}
    for wrong, said in (
        (openface_csv(OF_FIVE, STILL, AHEAD).replace("_r", "_x"), "only whether they are there"),
        (openface_csv(strong, STILL, AHEAD), r"a\.csv:2: an action unit is stronger"),
        (openface_csv(OF_FIVE, STILL, AHEAD, extra=backwards), "before the one before"),
        (openface_csv(OF_FIVE, STILL, AHEAD, extra=never), "no face is seen in any"),
    ):
        with pytest.raises(FormatError, match=said):
            fba.read(saved(tmp_path, wrong))


def test_pyfeat(tmp_path: Path) -> None:
    """Probabilities up to a half are nothing; 1 is what units usually are, C of FACS's A to E: 0.6."""
    text = pyfeat_csv({**STRENGTHS, 43: WAVE}, frames=np.arange(ROWS) * 2.0)
    path = saved(tmp_path, text)
    assert format_of(path).name == "pyfeat"
    with pytest.raises(
        FormatError, match="no column of times; give the frame rate of the film with source_rate=30"
    ):
        pyfeat.read_face(path)
    motion = pyfeat.read_face(path, source_rate=50)
    assert isinstance(motion, ActionUnitMotion)
    order = tuple(sorted((*UNITS, 43)))
    assert (motion.units, motion.rate) == (order, 25)
    units = {**STRENGTHS, 43: WAVE}
    for column, unit in enumerate(order):
        strongest = 1.0 if unit in (43, 45) else 0.6
        expected = strongest * np.maximum(2 * units[unit] - 1, 0)
        np.testing.assert_allclose(motion.intensities[:, column], expected, atol=1e-5)
    assert "how likely each is to be there, not how strong it is" in motion.findings[0]
    assert "pose is left out" in motion.findings[-1]
    people = ["Ann", "Bo"] * (ROWS // 2)
    twice = np.repeat(np.arange(ROWS // 2), 2).astype(float)
    path = saved(tmp_path, pyfeat_csv(STRENGTHS, frames=twice, identity=people))
    with pytest.raises(FormatError, match="has several faces"):
        pyfeat.read_face(path, source_rate=25)
    assert len(pyfeat.read_face(path, source_rate=25, face="Bo")) == ROWS // 2


def test_the_samples(shared: Path) -> None:
    motion = openface.read_face(shared / "data/capture/OpenFace_Test.csv")
    assert (len(motion), motion.units) == (100, UNITS)
    assert motion.eyes is not None
    assert 0.2 < motion.head[:, 0].mean() < 0.4
    old = pyfeat.read_face(shared / "data/capture/Feat_Test.csv")
    assert isinstance(old, ActionUnitMotion)
    assert len(old.units) == 20


def shown(units: dict[int, Float64 | float]) -> dict[str, int]:
    columns = np.array([[float(np.max(values)) for values in units.values()]])
    motion = ActionUnitMotion(tuple(units), columns, np.zeros(1), 25)  # type: ignore[arg-type]
    face = from_action_units(motion).face
    return {name: int(face.values[0, number - 1]) for name, number in fap_numbers().items()}


def test_action_units_do_what_facs_says() -> None:
    assert set(UNITS) <= set(unit_shapes())
    for unit, shapes in unit_shapes().items():
        assert set(shapes) <= set(arkit_names()), unit
    assert shown({1: 1.0})["raise_l_i_eyebrow"] > 200
    assert shown({4: 1.0})["raise_r_i_eyebrow"] < -100 < 0 < shown({4: 1.0})["squeeze_r_eyebrow"]
    smile, frown = shown({12: 1.0}), shown({15: 1.0})
    assert smile["raise_l_cornerlip"] == smile["raise_r_cornerlip"] > 400 > -200 > frown["raise_l_cornerlip"]
    closed = shown({45: 1.0})
    assert closed["close_t_l_eyelid"] + closed["close_b_l_eyelid"] == 1024
    jaw = shape_faps("jawOpen")
    assert shown({26: 0.5})["open_jaw"] == round(0.25 * jaw[2])
    assert shown({43: 1.0, 45: 1.0}) == closed  # of units that do the same, none is added
    with pytest.raises(ModelError, match="no action unit is known here: 99"):
        shown({99: 1.0})
