"""Tables of faces in all the ways that makers vary them, from one known face: it comes back."""

import json
import warnings
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import fba
from fba.arrays import Float64
from fba.capture import ActionUnitMotion, ShapeMotion
from fba.errors import FormatError
from fba.face import FaceModel
from fba.formats import format_of
from fba.formats.face_tables import _openface as openface
from fba.formats.face_tables import _pyfeat as pyfeat
from fba.formats.face_tables import _shapes_json as shapes_json
from fba.formats.face_tables._livelink_csv import read_face
from fba.parameters import fap_numbers
from format_files import saved
from tools.captures.face_files import ANGLES, camel, face_angles, face_weights, livelink_csv
from tools.captures.tracked_actor import film

ROWS = 48
WEIGHTS = {camel(name): values for name, values in face_weights(ROWS).items()}
POSE = np.stack([0.2 * np.sin(np.arange(ROWS) / 9 + one) for one in range(3)], axis=1)
"""Pitch, yaw and roll, radians, as FAPs count them: down, to the left, to the right."""
UNITS = ("AU01", "AU02", "AU04", "AU06", "AU12", "AU25", "AU43")
CLOCK = [f"00:{row // 25:02}" for row in range(ROWS)]
"""Whole seconds of a film of 25 frames in a second."""


def pyfeat_columns(*, mesh: bool = False, shapes: bool = True) -> dict[str, list[str]]:
    """Return columns as py-feat 2 writes them. mesh: also those of its own model."""
    columns: dict[str, Float64] = {
        "FaceRectX": np.full(ROWS, 217.8), "FaceRectY": np.full(ROWS, 222.9),
        "FaceRectWidth": np.full(ROWS, 658.3), "FaceRectHeight": np.full(ROWS, 658.3),
        "FaceScore": np.full(ROWS, 0.9999),
    }  # fmt: skip
    positions = film(FaceModel.default(), 68, frames=ROWS, flat=True).motion.positions
    columns |= {f"{axis}_{n}": positions[:, n, k] for k, axis in enumerate("xy") for n in range(68)}
    columns |= dict(zip(("Pitch", "Yaw", "Roll"), (POSE * [1, -1, 1]).T, strict=True))
    columns |= {unit: np.full(ROWS, 0.97) for unit in UNITS}
    if mesh:
        columns |= {"gaze_pitch": np.zeros(ROWS), "gaze_yaw": np.zeros(ROWS)}
        columns |= {f"mesh_{axis}_{n}": np.zeros(ROWS) for axis in "xyz" for n in range(478)}
    columns |= {f"Identity_{n}": np.zeros(ROWS) for n in range(1, 40)}
    if shapes:
        columns |= {"_neutral": np.zeros(ROWS)} | {n: v for n, v in WEIGHTS.items() if n != "tongueOut"}
    columns["frame"] = np.arange(float(ROWS))
    texts = {name: [f"{one:.7g}" for one in values] for name, values in columns.items()}
    return texts | {"input": ["a.mp4"] * ROWS, "approx_time": CLOCK, "Identity": [""] * ROWS}


def table(columns: dict[str, list[str]], separator: str = ",", mark: str = "", end: str = "\n") -> str:
    lines = [separator.join(columns), *(separator.join(row) for row in zip(*columns.values(), strict=True))]
    text = end.join(lines) + end
    return mark + (text.replace(".", ",") if separator == ";" else text)


def shuffled(columns: dict[str, list[str]], seed: int) -> dict[str, list[str]]:
    return {name: columns[name] for name in np.random.default_rng(seed).permutation(list(columns)).tolist()}


VARIANTS = list(product(range(2), (",", ";", "\t"), ("", "\ufeff"), ("\n", "\r\n")))


@pytest.mark.parametrize(("seed", "separator", "mark", "end"), VARIANTS)
def test_py_feat_2_is_read_by_its_blendshapes(
    tmp_path: Path, seed: int, separator: str, mark: str, end: str
) -> None:
    """Its tables have ARKit's names, but are none of Live Link Face's; their head turns."""
    columns = shuffled(pyfeat_columns(mesh=bool(seed)), seed)
    path = saved(tmp_path, table(columns, separator, mark, end))
    assert format_of(path).name == "pyfeat"
    motion = pyfeat.read_face(path)
    assert isinstance(motion, ShapeMotion)
    assert motion.rate == 25
    for name, weights in zip(motion.names, motion.weights.T, strict=True):
        np.testing.assert_allclose(weights, WEIGHTS[name], atol=1e-6)
    assert sorted([*motion.names, "tongueOut"]) == sorted(WEIGHTS)
    assert motion.head is not None
    if seed:
        np.testing.assert_allclose(motion.head, POSE, atol=1e-6)
    else:
        truth = film(FaceModel.default(), 68, frames=ROWS, flat=True).faps[:, 47:50] * 1e-5
        np.testing.assert_allclose(motion.head, truth, atol=0.06)
    assert len(motion.findings) < 5
    assert not any("mean nothing here" in finding for finding in motion.findings)


def test_frames_with_several_faces_and_no_names_of_them(tmp_path: Path) -> None:
    """Two people walk towards each other; the larger one, 1, is away for a while."""
    columns = pyfeat_columns()
    rows: list[list[str]] = []
    names = list(columns)
    for row in range(ROWS):
        for person, left in enumerate((100 + 3 * row, 900 - 5 * row)):
            if person and 10 <= row < 14:
                continue
            cells = [values[row] for values in columns.values()]
            size = 120 + 100 * person
            for name, value in (("FaceRectX", left), ("FaceRectWidth", size), ("FaceRectHeight", size)):
                cells[names.index(name)] = str(value)
            cells[names.index("jawOpen")] = f"{person}"
            rows.append(cells)
        if row % 2 and not 10 <= row < 14:
            rows[-2:] = rows[-2:][::-1]
    path = saved(tmp_path, "\n".join(",".join(cells) for cells in [names, *rows]))
    with pytest.raises(FormatError, match=r"has several faces: 2 \(48 rows\), 1 \(44 rows\)"):
        pyfeat.read_face(path)
    for face, person, count in (("1", 1, 44), ("2", 0, 48)):
        motion = pyfeat.read_face(path, face=face)
        assert isinstance(motion, ShapeMotion)
        assert motion.weights[:, motion.names.index("jawOpen")].tolist() == [person] * count


def test_rows_without_a_face(tmp_path: Path) -> None:
    columns = pyfeat_columns(mesh=True)
    for name, values in columns.items():
        if name not in ("frame", "input", "approx_time"):
            values[5] = "" if name != "FaceScore" else "0.0"
    motion = pyfeat.read_face(saved(tmp_path, table(columns)))
    assert np.flatnonzero(~motion.seen).tolist() == [5]  # type: ignore[union-attr]
    assert any("1 of 48 rows have no face" in finding for finding in motion.findings)


@pytest.mark.parametrize("rate", [24, 25, 30, 50, 60])
def test_whole_seconds_tell_the_rate_of_a_film(tmp_path: Path, rate: int) -> None:
    columns = pyfeat_columns()
    numbers = 3 * np.arange(ROWS)
    columns["frame"] = [str(one) for one in numbers]
    columns["approx_time"] = [f"{one // rate // 60:02}:{one // rate % 60:02}" for one in numbers]
    motion = pyfeat.read_face(saved(tmp_path, table(columns)))
    np.testing.assert_allclose(motion.times, numbers / rate)


@pytest.mark.parametrize("gone", [None, "pose_Rx", "gaze_0_x", "confidence"])
@pytest.mark.parametrize(("degrees", "separator", "mark"), [(0, ", ", ""), (1, ";", "\ufeff"), (0, "\t", "")])
def test_openface(tmp_path: Path, gone: str | None, degrees: int, separator: str, mark: str) -> None:
    """Its angles are radians; other tools write degrees, with which heads would look backwards."""
    columns: dict[str, Float64] = {"frame": np.arange(1.0, ROWS + 1), "timestamp": np.arange(ROWS) / 30}
    columns |= {"confidence": np.full(ROWS, 0.9), "success": np.ones(ROWS)}
    columns |= {f"gaze_{eye}_{axis}": np.full(ROWS, -1.0 * (axis == "z")) for eye in (0, 1) for axis in "xyz"}
    unit = 180 / np.pi if degrees else 1.0
    columns |= {
        f"pose_R{axis}": values * unit for axis, values in zip("xyz", (POSE * (1, 0, 0)).T, strict=True)
    }
    columns |= {f"{name}_r": np.full(ROWS, 2.5) for name in UNITS}
    columns = {name: values for name, values in columns.items() if name != gone}
    texts = {name: [f"{one:.7g}" for one in values] for name, values in columns.items()}
    path = saved(tmp_path, table(shuffled(texts, 3), separator, mark))
    assert format_of(path).name == "openface"
    motion = openface.read_face(path)
    np.testing.assert_allclose(motion.intensities, 0.5)
    if gone == "pose_Rx":
        assert motion.head is None
    else:
        assert motion.head is not None
        np.testing.assert_allclose(motion.head, POSE * (1, 0, 0), atol=1e-5)
        assert any("taken as degrees" in finding for finding in motion.findings) == bool(degrees)


@pytest.mark.parametrize("degrees", [False, True])
def test_angles_of_blendshape_tables(tmp_path: Path, degrees: bool) -> None:
    turns = {name: values * (180 / np.pi if degrees else 1.0) for name, values in face_angles(ROWS).items()}
    upper = {name[0].upper() + name[1:]: values for name, values in WEIGHTS.items()}
    motion = read_face(saved(tmp_path, livelink_csv({**upper, **turns})), swap="no")
    yaw = face_angles(ROWS)[ANGLES[0]]
    np.testing.assert_allclose(motion.head[:, 1], yaw, atol=1e-6)
    np.testing.assert_allclose(motion.eyes[:, 0], -face_angles(ROWS)["LeftEyeYaw"], atol=1e-6)
    assert any("taken as degrees" in finding for finding in motion.findings) == degrees


def test_a_table_with_thousands_of_other_columns_says_so_shortly(tmp_path: Path) -> None:
    upper = {name[0].upper() + name[1:]: values for name, values in WEIGHTS.items()}
    others = {f"mesh_{axis}_{n}": np.zeros(ROWS) for axis in "xyz" for n in range(478)}
    motion = read_face(saved(tmp_path, livelink_csv({**others, **upper, "Mood": np.zeros(ROWS)})))
    assert motion.findings[0] == (
        "columns that mean nothing here are left out: mesh_x_0 and 477 like it, mesh_y_0 and 477 like it, "
        "mesh_z_0 and 477 like it, Mood"
    )


def layouts(frames: list[dict[str, float]]) -> Iterator[tuple[str, object]]:
    """Yield layouts in which programs save frames of shapes, which last a 30th of a second."""
    named = list(enumerate(frames))
    yield "times", [{"time": n / 30, "blendshapes": one} for n, one in named]
    yield "flat", [{"timestamp": n / 30, **one} for n, one in named]
    yield "frames", {"frames": [{"t": n / 30, "faces": [{"shapes": one}]} for n, one in named]}
    yield (
        "list",
        [
            {"timeMs": 1000 * n / 30, "categories": [{"categoryName": k, "score": v} for k, v in one.items()]}
            for n, one in named
        ],
    )
    names = list(frames[0])
    rows = [{"weights": list(one.values()), "time": n / 30} for n, one in named]
    yield "beat", {"names": names, "frames": rows}


@pytest.mark.parametrize("count", [1, 2, 4, 20, 52])
def test_json_with_few_names(tmp_path: Path, count: int) -> None:
    """A recording of a jaw and two lids is one, too."""
    chosen = ["jawOpen", "eyeBlinkLeft", "eyeBlinkRight", "mouthSmileLeft", *WEIGHTS]
    chosen = list(dict.fromkeys(chosen))[:count]
    frames = [{name: float(WEIGHTS[name][row]) for name in chosen} for row in range(ROWS)]
    for name, document in layouts(frames):
        path = saved(tmp_path, json.dumps(document), f"{name}.json")
        assert format_of(path).name == "shapes-json", name
        motion = shapes_json.read_face(path)
        assert (sorted(motion.names), motion.rate) == (sorted(chosen), 30), name
        for shape, weights in zip(motion.names, motion.weights.T, strict=True):
            np.testing.assert_allclose(weights, WEIGHTS[shape])


def test_json_says_which_names_it_leaves_out(tmp_path: Path) -> None:
    frames = [
        {"time": n / 60, "blendshapes": {"jawOpen": 0.5, "headRoll": 0.1, "_neutral": 0}} for n in range(9)
    ]
    motion = shapes_json.read_face(saved(tmp_path, json.dumps(frames), "a.json"))
    assert motion.findings[0] == "names that mean nothing here are left out: headRoll"


def test_the_samples_of_others(shared: Path) -> None:
    """py-feat 2's film of a woman who smiles: read by its blendshapes; her head moves."""
    folder = shared / "data/foreign/faces"
    motion = pyfeat.read_face(folder / "pyfeat_news003.csv")
    assert isinstance(motion, ShapeMotion)
    assert (len(motion), motion.rate, len(motion.names)) == (24, 12, 51)
    with warnings.catch_warnings(action="ignore"):
        face = fba.read(folder / "pyfeat_news003.csv").face
    moved = face.values[:, [fap_numbers()[name] - 1 for name in ("head_pitch", "head_yaw", "head_roll")]]
    assert (np.ptp(moved, axis=0) > 2000).all()
    old = pyfeat.read_face(shared / "data/capture/Feat_Test.csv")
    assert isinstance(old, ActionUnitMotion)
    strengths = dict(zip(old.units, old.intensities[0], strict=True))
    assert strengths[15] == strengths[11] == 0.0  # probabilities of 0.34 and 0.42 in a smile
    assert 0.5 < strengths[12] < 0.6
