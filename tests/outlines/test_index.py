"""The index: what is found in it, its file, and files that are none."""

import io
import json
import zipfile
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fba.body import BodyModel
from fba.errors import FbaError, FormatError, LimitError
from fba.face import FaceModel
from fba.limits import Limits
from fba.outlines import Choice, Figure, Index, View, build_index, draw_sheet, draw_silhouette
from fba.outlines._figure import read_poses
from outlined import nodding, raising

Arrays = dict[str, Any]


@pytest.fixture(scope="module")
def person() -> Figure:
    return Figure(FaceModel.default(), BodyModel.default())


def pictured(figure: Figure, frame: int, view: View) -> np.ndarray:
    poses = read_poses(raising(), figure.model)
    return draw_silhouette(
        figure.vertices(poses.faps[frame], poses.baps[frame]), figure.triangles, view, side=300
    )


def test_every_silhouette_finds_itself(index: Index) -> None:
    assert len(index) == (6 + 4) * 8
    for number in range(0, len(index), 7):
        hits = index.search(index.silhouette(number), 2)
        hit = next(hit for hit in hits if hit.number == number)  # what a body hides, another frame may have
        assert hit.distance == hits[0].distance == pytest.approx(0, abs=1e-6)
        assert hit.stream == ("raising" if number < 48 else "nodding")
        assert hit.frame == (number // 8 if number < 48 else number // 8 - 6)
        assert hit.seconds == (hit.frame * 2 / 5 if number < 48 else hit.frame / 25)
        assert hit.view == index.views[number % 8]


def test_a_picture_from_between_its_sides_is_found(index: Index, person: Figure) -> None:
    """Larger, and turned by 12 degrees: the pose, and the nearest of the eight sides."""
    for frame in (1, 3, 5):
        hits = index.search(pictured(person, frame, View(12)), 10)
        assert (hits[0].stream, hits[0].view) == ("raising", View(0))
        assert abs(hits[0].frame - frame) <= 1
        assert [hit.distance for hit in hits] == sorted(hit.distance for hit in hits)


def test_the_other_side_is_another_side(index: Index, person: Figure) -> None:
    mask = pictured(person, 4, View())
    (other,) = index.search(mask, 1, away_from=View(0))
    assert abs(other.view.yaw) >= 60
    assert other.distance > index.search(mask, 1)[0].distance


def test_a_sequence_keeps_its_side(index: Index, person: Figure) -> None:
    masks = [pictured(person, frame, View(170)) for frame in range(6)]
    found = index.search_sequence(masks)
    assert {hit.view.yaw for hit in found} == {-180.0}
    frames = [hit.frame for hit in found]
    assert frames == sorted(frames)


def test_what_is_found_becomes_an_animation(index: Index) -> None:
    hits = [index.search(index.silhouette(pose * 8), 1)[0] for pose in (0, 3, 5, 7)]
    animation = index.animation(hits, Fraction(10))
    assert (animation.rate, len(animation)) == (10, 4)
    source = raising().body
    assert np.array_equal(animation.body.values[:3], source.values[[0, 3, 5]])
    assert np.array_equal(animation.body.mask[:3], source.mask[[0, 3, 5]])
    assert not animation.body.mask[3].any()
    assert animation.face.values[3, 48] == 20_000
    assert not animation.face.mask[:3].any()


def test_an_index_is_read_as_it_was_written(index: Index, tmp_path: Path) -> None:
    index.save(tmp_path / "index.npz")
    back = Index.load(tmp_path / "index.npz")
    assert (back.streams, back.views) == (index.streams, index.views)
    for name in ("faps", "baps", "pose_frames", "pose_indices", "pose_streams", "masks", "descriptions"):
        assert np.array_equal(getattr(back.stored, name), getattr(index.stored, name))
    with np.load(tmp_path / "index.npz") as arrays:  # by NumPy itself
        assert arrays["descriptions"].shape == (80, 64, 3)
        assert json.loads(arrays["about"].tobytes())["format"] == "fba-outlines"


def test_the_views_are_even_and_begin_at_the_front() -> None:
    views = Choice(views=6, pitches=(0, 30)).all_views
    assert views[0] == View(0, 0)
    assert sorted(view.yaw for view in views[:6]) == [-180, -120, -60, 0, 60, 120]
    assert [view.pitch for view in views] == 6 * [0] + 6 * [30]
    with pytest.raises(ValueError, match="at least 1"):
        Choice(views=0)


def test_too_much_and_too_little_is_refused() -> None:
    with pytest.raises(LimitError, match="100000000 silhouettes are more than the 200000"):
        build_index([("all", nodding())], Choice(views=100_000_000))
    with pytest.raises(FbaError, match="at least one frame"):
        build_index([("none", nodding()[:0])])


def test_a_sheet_has_a_row_for_each_picture(index: Index) -> None:
    masks = [index.silhouette(3), index.silhouette(50)]
    sheet = draw_sheet(index, masks, [index.search(mask, 4) for mask in masks])
    assert sheet.shape == (2 * 184, 5 * 150, 3)
    assert (sheet[:150, :150] != sheet[0, 0]).any()
    dark = sheet[:145, :, 0] < 140
    assert (dark[:, :150] ^ dark[:, 150:300]).mean() < 0.005  # the nearest is the picture's own


def resaved(source: Path, change: Callable[[Arrays], None]) -> bytes:
    with np.load(source) as file:
        arrays = dict(file)
    change(arrays)
    target = io.BytesIO()
    np.savez(target, **arrays)
    return target.getvalue()


def told(**changes: object) -> Callable[[Arrays], None]:
    def change(arrays: Arrays) -> None:
        about = {**json.loads(arrays["about"].tobytes()), **changes}
        arrays["about"] = np.frombuffer(json.dumps(about).encode(), dtype=np.uint8)

    return change


def put(name: str, make: Callable[[Any], Any]) -> Callable[[Arrays], None]:
    def change(arrays: Arrays) -> None:
        arrays[name] = make(arrays[name])

    return change


STREAM = {"name": "x", "rate": "25", "faps": [], "baps": []}
CONTRADICTIONS = {
    "another format": (told(format="x"), "not an index of outlines"),
    "a later version": (told(version=2), "version 2, and 1 is read"),
    "no views": (told(views=[]), "its views are no angles"),
    "views of text": (told(views=[["a", 0]]), "not an index of outlines, or is damaged"),
    "views without end": (told(views=[[float("inf"), 0]]), "its views are no angles"),
    "fewer views": (told(views=[[0, 0]]), "belong to 10 poses and 1 views"),
    "no streams": (told(streams=[]), "no frame rate"),
    "a rate of 0": (told(streams=[STREAM | {"rate": "0"}] * 2), "no frame rate"),
    "a rate of 1/0": (told(streams=[STREAM | {"rate": "1/0"}] * 2), "ZeroDivisionError"),
    "one stream less": (told(streams=[STREAM]), "streams beyond the 1"),
    "FAP 69": (told(streams=[STREAM | {"faps": [69]}] * 2), "no parameter 69"),
    "streams as text": (told(streams="ab"), "damaged"),
    "no JSON": (put("about", lambda about: about[:9]), "damaged"),
    "deep JSON": (put("about", lambda _: np.frombuffer(b"[" * 100_000, np.uint8)), "damaged"),
    "no masks": (lambda arrays: arrays.pop("masks"), "no array 'masks'"),
    "fewer masks": (put("masks", lambda masks: masks[:-1]), "'masks' has uint8"),
    "floating poses": (put("baps", lambda baps: baps.astype(float)), "'baps' has float64"),
    "no poses": (put("pose_streams", lambda each: each[:0]), "without any"),
    "a number for an array": (put("pose_streams", lambda _: np.array(1)), "without any"),
    "a stream below 0": (put("pose_streams", lambda each: each - 1), "streams beyond the 2"),
    "infinite outlines": (put("descriptions", lambda each: each * np.inf), "not finite"),
    "objects": (put("about", lambda _: np.array([{}])), "'about' is damaged"),
    "columns first": (put("baps", np.asfortranarray), "'baps' is damaged"),
}


@pytest.mark.filterwarnings("ignore:invalid value encountered")
@pytest.mark.parametrize("name", CONTRADICTIONS)
def test_a_file_that_contradicts_itself(index: Index, tmp_path: Path, name: str) -> None:
    change, text = CONTRADICTIONS[name]
    path = tmp_path / "index.npz"
    index.save(path)
    path.write_bytes(resaved(path, change))
    with pytest.raises(FormatError, match=text) as caught:
        Index.load(path)
    assert str(path) in str(caught.value)


def test_a_header_that_promises_too_much(index: Index, tmp_path: Path) -> None:
    path = tmp_path / "index.npz"
    index.save(path)
    for shape in ("(9999999999, 296)", "(4000000, 4000000, 4000000)", "(-1, 296)"):
        target = io.BytesIO()
        with zipfile.ZipFile(path) as source, zipfile.ZipFile(target, "w") as changed:
            for entry in source.infolist():
                data = source.read(entry)
                if entry.filename == "baps.npy":
                    header = (
                        f"{{'descr': '<i4', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
                    )
                    data = b"\x93NUMPY\1\0" + len(header).to_bytes(2, "little") + header.encode() + data[128:]
                changed.writestr(entry.filename, data)
        (tmp_path / "bomb.npz").write_bytes(target.getvalue())
        with pytest.raises(FormatError, match="'baps' is damaged"):
            Index.load(tmp_path / "bomb.npz")


def test_an_archive_that_swells(index: Index, tmp_path: Path) -> None:
    path = tmp_path / "index.npz"
    index.save(path)
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("more.npy", bytes(200_000_000))
    with pytest.raises(LimitError, match=r"index.npz: an index takes \d+ bytes"):
        Index.load(path)
    assert len(Index.load(path, limits=Limits(bytes=300_000_000))) == len(index)


def test_files_that_are_damaged_anywhere(index: Index, tmp_path: Path) -> None:
    """Whatever is cut off or changed, it is an error of ours, or the same index."""
    path = tmp_path / "index.npz"
    index.save(path)
    whole = path.read_bytes()
    random = np.random.default_rng(4)
    for cut in [0, 1, 4, 100, *random.integers(len(whole), size=20).tolist(), len(whole) - 1]:
        path.write_bytes(whole[:cut])
        with pytest.raises(FormatError):
            Index.load(path)
    intact = 0
    for place in random.integers(len(whole), size=150).tolist():
        path.write_bytes(whole[:place] + bytes([whole[place] ^ (1 << place % 8)]) + whole[place + 1 :])
        try:
            back = Index.load(path)
        except FormatError:
            continue
        intact += 1
        assert np.array_equal(back.stored.descriptions, index.stored.descriptions)
    assert intact < 30
