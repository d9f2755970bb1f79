"""Scans in the layout of Bosphorus, written here: names, clouds, landmarks, depth maps and examples."""

import struct
from pathlib import Path

import numpy as np
import pytest

from fba.errors import FormatError, ModelError
from fba.face import FeaturePointFace
from fba.persona.points.layout import points_of_face
from tools.persona.training.bosphorus import parse_name, read_cloud, read_database, read_landmarks, read_scan
from tools.persona.training.classes import class_faps, face_classes
from tools.persona.training.depth_maps import DepthMap, cut_out_face, fill_holes, find_outline, make_depth_map

PIXELS = 4.0
"""Pixels of the picture in a millimetre."""


def write_cloud(path: Path, points: np.ndarray, background: float = -1e9, side: int = 100) -> None:  # type: ignore[type-arg]
    """A .bnt file of side x side points: those that are missing lie in the background."""
    full = np.full((side * side, 5), background)
    full[: len(points), :3] = points
    header = struct.pack("<HHdH", side, side, background, 5) + b"a.png" + struct.pack("<I", full.size)
    path.write_bytes(header + full.T.astype("<f8").tobytes())


def bowl(x: np.ndarray, y: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
    """Depth of something like a face, millimetres: highest in the middle."""
    return np.asarray(30 - (x / 12) ** 2 - ((y + 30) / 16) ** 2)


def write_scan(folder: Path, name: str, label: str, amount: float) -> np.ndarray:  # type: ignore[type-arg]
    """A scan of the standard face that shows a class; returns its 64 points in the cloud, (64, 2)."""
    row = [one.name for one in face_classes()].index(label)
    points = points_of_face(FeaturePointFace().local(amount * class_faps()[row]).astype(np.float64))[:64, :2]
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(-90, 90, 230), np.linspace(-125, 80, 230)))
    cloud = np.column_stack([x, y, bowl(x, y)])
    hole = np.linalg.norm(cloud[:, :2] - (20, -40), axis=1) < 5
    path = folder / f"{name}.bnt"
    write_cloud(path, cloud[~hole], side=230)
    marks = {f"mark {n}": place for n, place in enumerate(cloud[::2400][:22])}
    for suffix, width in ((".lm2", 2), (".lm3", 3)):
        lines = ["# made up", "22 landmarks:", ""]
        for mark, place in marks.items():
            shown = place if width == 3 else PIXELS * place[:2] * (1, -1) + (800, 600)
            lines += [mark, " ".join(f"{one:.6f}" for one in shown)]
        path.with_suffix(suffix).write_text("\n".join(lines))
    np.savez(path.with_suffix(".npz"), points=PIXELS * points * (1, -1) + (800, 600))
    return np.asarray(points)


def test_names_of_scans() -> None:
    name = parse_name("bs042_LFAU_9_0")
    assert (name.person, name.kind, name.expression, name.counter) == ("bs042", "LFAU", "9", 0)
    labels = {
        "bs000_N_N_1": "NEUTRAL", "bs001_E_HAPPY_0": "E_HAPPY", "bs001_UFAU_43_0": "UFAU_43",
        "bs001_LFAU_12LW_0": "LFAU_12", "bs001_CAU_A12A15_0": "CAU_A12A15",
        "bs001_YR_R10_0": "", "bs001_O_EYE_0": "",
    }  # fmt: skip
    assert {name: parse_name(name).label for name in labels} == labels
    with pytest.raises(FormatError, match="no name of a scan"):
        parse_name("person1_smile")


def test_a_scan_gives_80_points_with_depth(tmp_path: Path) -> None:
    true = write_scan(tmp_path, "bs001_N_N_0", "NEUTRAL", 0.0)
    points = read_scan(tmp_path / "bs001_N_N_0.bnt")
    assert points.shape == (80, 3)
    np.testing.assert_allclose(points[:64, :2], true, atol=1e-3)
    hole = np.linalg.norm(points[:64, :2] - (20, -40), axis=1) < 6
    expected = bowl(points[:64, 0], points[:64, 1])
    np.testing.assert_allclose(points[:64, 2][~hole], expected[~hole], atol=1)
    np.testing.assert_allclose(points[:64, 2][hole], expected[hole], atol=2)  # filled


def test_a_database_gives_examples(tmp_path: Path) -> None:
    (tmp_path / "bs001").mkdir()
    (tmp_path / "bs002").mkdir()
    write_scan(tmp_path / "bs001", "bs001_N_N_0", "NEUTRAL", 0.0)
    write_scan(tmp_path / "bs001", "bs001_LFAU_27_0", "LFAU_27", 0.8)
    write_scan(tmp_path / "bs002", "bs002_E_HAPPY_0", "E_HAPPY", 0.8)  # nobody knows the face at rest
    (tmp_path / "bs001" / "bs001_YR_R45_0.bnt").write_bytes(b"not read: the head is turned")
    examples = read_database(tmp_path)
    names = [face_classes()[row].name for row in examples.classes]
    assert names == ["LFAU_27", "NEUTRAL"]
    moved = (examples.points - examples.neutral)[0]
    assert moved[38, 1] < -10  # the lower lip
    np.testing.assert_allclose((examples.points - examples.neutral)[1], 0, atol=1e-9)
    with pytest.raises(FormatError, match="no scans of a person with a neutral one"):
        read_database(tmp_path / "bs002")


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"\x01\x00", "cut off in its header"),
        (struct.pack("<HHdH", 9, 9, 0.0, 0) + struct.pack("<I", 7), "not 5 a point"),
        (struct.pack("<HHdH", 9000, 9000, 0.0, 0) + struct.pack("<I", 5 * 9000 * 9000), "9000 rows"),
        (struct.pack("<HHdH", 9, 9, 0.0, 0) + struct.pack("<I", 405) + b"1234", "cut off: 4 bytes of 3240"),
        (struct.pack("<HHdH", 1, 1, 0.0, 0) + struct.pack("<I", 5) + bytes(40), "no point in front"),
    ],
)
def test_damaged_clouds(tmp_path: Path, data: bytes, said: str) -> None:
    (tmp_path / "a.bnt").write_bytes(data)
    with pytest.raises(FormatError, match=said):
        read_cloud(tmp_path / "a.bnt")


@pytest.mark.parametrize(
    ("text", "said"), [("a\n1 x\n", "no coordinates"), ("a\n1\n", "2 coord"), ("a\n1 2\n", "has 1 ")]
)
def test_damaged_landmarks(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "a.lm2").write_text(text)
    with pytest.raises(FormatError, match=said):
        read_landmarks(tmp_path / "a.lm2")


def test_holes_are_filled_one_after_another() -> None:
    """The first hole gets the mean of the cells around it that are known, the next one counts it, too."""
    depth = np.array([[1.0, 2, 3, 4], [5, np.nan, np.nan, 6], [7, 8, 9, 10]])
    filled = fill_holes(DepthMap(depth, np.zeros(2)), np.array([[0.0, 0], [3, 0], [0, 2], [3, 2]])).depth
    first = np.mean([1, 2, 3, 5, 7, 8, 9])
    assert filled[1, 1] == pytest.approx(first)
    assert filled[1, 2] == pytest.approx(np.mean([2, 3, 4, first, 6, 8, 9, 10]))


def test_the_outline_is_where_the_face_ends() -> None:
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(-60, 61.0), np.arange(-60, 61.0)))
    deep = 40 - np.hypot(x, y)  # a cone: depth 10 at 30 mm
    map_ = make_depth_map(np.column_stack([x, y, deep]))
    face = cut_out_face(map_, tip=40.0, brow=20.0)
    assert face.sum() == pytest.approx(np.pi * 30**2, rel=0.03)
    outline = find_outline(map_, 40.0, 20.0)
    np.testing.assert_allclose(np.hypot(*outline.T), 30, atol=1.6)
    assert np.degrees(np.arctan2(outline[1, 1], outline[1, 0])) == pytest.approx(22.5, abs=1)
    with pytest.raises(ModelError, match="no face could be cut out"):
        find_outline(map_, -500.0, -400.0)
