"""Virtual markers of lids, which move rows, and eyes that look at the camera.

TOML files of virtual markers: what is written is read, and what is wrong in one is named.
"""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from fba.capture.virtual_markers import (
    MarkedHead,
    MarkerMapping,
    MarkerPerformance,
    VirtualMarker,
    head_of_model,
    move_head,
    propose_mapping,
    read_head,
)
from fba.capture.virtual_markers._mapping_files import read_mapping, write_mapping
from fba.capture.virtual_markers.lids import find_rows, lid_at, turn_to_camera
from fba.capture.virtual_markers.mapping import MadeFor
from fba.errors import FormatError, ModelError, OptionError
from fba.face import FaceModel
from fba.formats.gltf.moved_head import write_moved_head
from fba.gltf._reader import read_gltf
from fba.parameters import point_rows
from tools.captures.marked_actor import perform as act

MAPPING = MarkerMapping(
    {
        "Chin": VirtualMarker(12, 0.02, 0.03),
        'Anna:"L\u00e4chen"\n\x7f': VirtualMarker(7, 1e-9, 2.5),
        "FHL": VirtualMarker(1, 0.1, 0.1, fixed=True),
        "FHR": VirtualMarker(0, 0.1, 0.1, fixed=True),
        "Cap": VirtualMarker(None, fixed=True),
        "Lip": VirtualMarker(9, 0.5, 0.25, follows="Chin", share=0.75),
    },
    assignment="exclusive", overlap="add", scale=("FHL", "FHR"),
    made_for=MadeFor("head.obj", 20, 30, "00ff", "ff00"),
)  # fmt: skip
LEAST = '[virtual_markers]\n"Chin" = { vertex = 12, radius = 0.02 }\n'
UPPER, LOWER = "3.1", "3.3"
"""Middles of the left lids."""


@cache
def head() -> MarkedHead:
    return head_of_model(FaceModel.default())


def bound(point: str) -> int:
    return int(head().bound[point_rows()[point]])


@cache
def performed(gaze: str = "none", squint: float = 0.0) -> MarkerPerformance:
    motion = act(FaceModel.default(), 160, 50).motion
    mapping = replace(propose_mapping(motion, head()), gaze=gaze, squint=squint)
    return move_head(motion, head(), mapping)


@pytest.mark.parametrize(("middle", "rows"), [(UPPER, (1, 0.9, 0.7, 0)), (LOWER, (1, 0.9, 0))])
def test_rows_of_lids_are_those_of_the_source(middle: str, rows: tuple[float, ...]) -> None:
    """Rows at equal heights above the margin, by the thesis: 1, 0.9 and 0.7; below the eye two of them."""
    height = 0.006
    found = find_rows(head(), bound(middle), height)
    places, start = head().skin.vertices, int(head().skin.number[bound(middle)])
    assert (found.vertices[0], found.shares[0]) == (start, 1.0)
    side = f"left {'upper' if middle == UPPER else 'lower'} lid"
    landmarks = head().landmarks
    margin = landmarks.contour(side)
    away = np.linalg.norm(places[found.vertices][:, None] - places[margin], axis=2)
    central = away.argmin(axis=1) == np.flatnonzero(margin == start)[0]  # the Gaussian is 1 there, nearly
    assert central.sum() > 8
    expected = np.interp(away.min(axis=1) / height, np.linspace(0, 1, len(rows)), rows)
    np.testing.assert_allclose(found.shares[central], expected[central], atol=0.07)
    assert found.levels.max() == len(rows) - 1


def test_a_lid_moves_less_towards_its_corners_as_a_gaussian() -> None:
    found = find_rows(head(), bound(UPPER), 0.006)
    landmarks = head().landmarks
    margin = landmarks.contour("left upper lid")
    shares = dict(zip(found.vertices.tolist(), found.shares.tolist(), strict=True))
    way = np.cumsum(np.linalg.norm(np.diff(head().skin.vertices[margin], axis=0, prepend=0), axis=1))
    way = way - way[margin == head().skin.number[bound(UPPER)]]
    half = np.where(way < 0, -way[0], way[-1])
    for vertex, at in list(zip(margin.tolist(), way / half, strict=True))[1:-1]:
        assert shares[vertex] == pytest.approx(np.exp(-2 * at**2), abs=0.04)
    assert margin[0] not in shares  # corners belong to both lids
    assert not set(landmarks.contour("left lower lid").tolist()) & set(shares)


def opening(vertices: np.ndarray) -> float:
    return float(vertices[bound(UPPER), 1] - vertices[bound(LOWER), 1])


def test_squinting_lids_narrow_from_both_sides_and_still_shut() -> None:
    plain, narrowed = performed(), performed(squint=0.6)
    assert opening(narrowed.rest) == pytest.approx(0.4 * opening(plain.rest), rel=0.1)
    moved = narrowed.rest - plain.rest
    assert moved[bound(UPPER), 1] / moved[bound(LOWER), 1] == pytest.approx(-0.7 / 0.3, rel=0.15)
    eyeball = FaceModel.default().part("eye_left").vertices
    for middle in (UPPER, LOWER):  # lids slide over the eyeball, not into it
        near = [
            float(np.linalg.norm(eyeball - one.rest[bound(middle)], axis=1).min())
            for one in (plain, narrowed)
        ]
        assert near[1] > near[0] - 5e-4
    frames = range(0, len(plain), 5)
    least = [min(opening(one.vertices(frame)) for frame in frames) for one in (plain, narrowed)]
    assert least[0] < 0.3 * opening(plain.rest)  # a blink
    assert -2e-4 < least[1] < 0.3 * opening(plain.rest)


@pytest.mark.parametrize(("yaw", "pitch", "roll"), [(20, 0, 0), (0, -15, 0), (-25, 12, 8)])
def test_eyes_look_at_the_camera_however_the_head_turns(yaw: float, pitch: float, roll: float) -> None:
    about = [np.array(axis, dtype=float) for axis in ((0, 1, 0), (1, 0, 0), (0, 0, 1))]
    turned = np.eye(3)
    for axis, angle in zip(about, np.radians([yaw, pitch, roll]), strict=True):
        cross = np.cross(np.eye(3), axis)
        turned = turned @ (np.eye(3) + np.sin(-angle) * cross + (1 - np.cos(angle)) * cross @ cross)
    looks = turn_to_camera(turned[None])[0]
    np.testing.assert_allclose(turned @ looks @ (0, 0, 1), (0, 0, 1), atol=1e-9)
    np.testing.assert_allclose(looks @ looks.T, np.eye(3), atol=1e-9)


def test_eyes_turn_only_so_far() -> None:
    back = np.diag([-1.0, 1.0, -1.0])[None]
    for turned in (back, np.eye(3)[None, [1, 2, 0]]):
        look = turn_to_camera(turned)[0] @ (0, 0, 1)
        assert np.degrees(np.arccos(look[2])) < 50


def test_eyes_of_a_performance_keep_looking_at_the_camera() -> None:
    fixed, looking = performed(), performed(gaze="camera")
    start = FaceModel.default().starts["eye_left"]
    eye = FaceModel.default().part("eye_left").vertices
    front = start + int(eye[:, 2].argmax())
    turns = np.degrees(np.arccos(np.clip(looking.rotation[:, 2, 2], -1, 1)))
    frame = int(turns.argmax())
    assert turns[frame] > 8
    (one,) = (each for each in looking.eyes if front in each.rows)

    def look(shown: MarkerPerformance) -> np.ndarray:
        arm = shown.rotation[frame] @ (shown.vertices(frame)[front] - one.centre)
        return np.asarray(arm / np.linalg.norm(arm))

    before = head().vertices[front] - one.centre
    before /= np.linalg.norm(before)
    assert np.degrees(np.arccos(look(fixed) @ before)) > 8
    assert np.degrees(np.arccos(min(1.0, look(looking) @ before))) < 3  # roll is left to the head
    between = looking.vertices_between(frame, frame, 0.0)
    np.testing.assert_allclose(between, looking.vertices(frame))


def test_turning_eyes_are_written(tmp_path: Path) -> None:
    write_moved_head(tmp_path / "looking.glb", performed(gaze="camera"))
    content = read_gltf(tmp_path / "looking.glb")
    channels = content.animations[0].channels
    turning = {content.nodes[one.node].name for one in channels if one.path == "rotation"}
    assert turning >= {"head", "eye_left", "eye_right"}


def test_a_mapping_keeps_lids_gaze_and_squint(tmp_path: Path) -> None:
    markers = {"Lid": VirtualMarker(12, 0.006, 0.006, lid=True)}
    mapping = MarkerMapping(markers, gaze="camera", squint=0.25)
    write_mapping(tmp_path / "m.toml", mapping)
    assert read_mapping(tmp_path / "m.toml") == mapping
    plain = MarkerMapping({"Lip": VirtualMarker(12, 0.006, 0.006)})
    write_mapping(tmp_path / "plain.toml", plain)
    assert not {"lid", "gaze", "squint"} & set((tmp_path / "plain.toml").read_text().split())


def test_impossible_lids_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="is on no lid's margin that is known"):
        find_rows(head(), bound("2.1"), 0.006)
    with pytest.raises(OptionError, match="a lid's marker needs a vertex, and cannot be fixed"):
        VirtualMarker(3, 1.0, 1.0, fixed=True, lid=True)
    with pytest.raises(OptionError, match="gaze must be one of none, camera, not 'me'"):
        MarkerMapping(gaze="me")
    for squint in (-0.1, 1.1, float("nan")):
        with pytest.raises(OptionError, match="squint must be from 0 to 1"):
            MarkerMapping(squint=squint)
    mesh = tmp_path / "plain.obj"
    vertices, triangles = head().vertices, head().triangles
    mesh.write_text(
        "\n".join(f"v {x} {y} {z}" for x, y, z in vertices)
        + "\n"
        + "\n".join(f"f {a} {b} {c}" for a, b, c in triangles + 1)
    )
    motion = act(FaceModel.default(), 20, 50).motion
    mapping = replace(propose_mapping(motion, head()), made_for=None)
    shown = read_head(mesh)
    plain = {name: replace(one, lid=False) for name, one in mapping.markers.items()}
    for wanted, words in (
        (replace(mapping, markers=plain, gaze="camera"), "has no eyes that could look at the camera"),
        (replace(mapping, markers=plain, squint=0.5), "no eye can narrow"),
        (mapping, "is on no lid's margin"),
    ):
        with pytest.raises(ModelError, match=words):
            move_head(motion, shown, wanted)


def test_only_the_middle_of_a_margin_is_proposed_as_a_lid() -> None:
    proposed = propose_mapping(act(FaceModel.default(), 20, 50).motion, head())
    lids = {name: one for name, one in proposed.markers.items() if one.lid}
    assert set(lids) == {"LIDL", "LIDR"}
    assert lids["LIDL"].vertex == bound(UPPER)
    assert lid_at(head(), bound("2.1")) == lid_at(head(), 10**9) == lid_at(head(), -1) == ""


def test_what_is_written_is_read(tmp_path: Path) -> None:
    write_mapping(tmp_path / "m.toml", MAPPING)
    assert read_mapping(tmp_path / "m.toml") == MAPPING
    (tmp_path / "least.toml").write_text(LEAST)
    assert read_mapping(tmp_path / "least.toml") == MarkerMapping({"Chin": VirtualMarker(12, 0.02, 0.02)})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("[virtual_markers\n", "is not TOML: .*expected lines such as \"Chin\""),
        ("[markers]\nChin = '2.1'\n", r"has no table \[virtual_markers\]"),
        ("virtual_markers = 3\n", r"has no table \[virtual_markers\]"),
        ("[virtual_markers]\n", r"has no table \[virtual_markers\]"),
        ("[virtual_markers]\nChin = '2.1'\n", r"'Chin' is '2.1'; expected a table such as \{ vertex"),
        ("[virtual_markers]\nChin = { vertex = 1.5, radius = 1 }\n", "must be a whole number, not 1.5"),
        ("[virtual_markers]\nChin = { vertex = true, radius = 1 }\n", "must be a whole number, not True"),
        ("[virtual_markers]\nChin = { vertex = -1, radius = 1 }\n", "'Chin': vertices are counted from 0"),
        ("[virtual_markers]\nChin = { vertex = 1, radius = nan }\n", "the radius must be a positive number"),
        ("[virtual_markers]\nChin = { vertex = 1, radius = 1, depth = inf }\n", "the depth must be"),
        (f"[virtual_markers]\nChin = {{ vertex = 1, radius = 1{400 * '0'} }}\n", "'Chin': int too large"),
        (f"[virtual_markers]\nChin = {{ vertex = {5000 * '1'} }}\n", "is not TOML: Exceeds the limit"),
        ("[virtual_markers]\nChin = { vertex = 1 }\n", "'Chin' has no radius"),
        ("[virtual_markers]\nChin = { radius = 1 }\n", "'Chin' has no vertex; only fixed markers"),
        ("[virtual_markers]\nChin = { vertex = 1, raduis = 1 }\n", "'Chin': there is no 'raduis'; known are"),
        ("[virtual_markers]\nChin = { vertex = 1, radius = 1, follows = 2 }\n", "must be a text, not 2"),
        ("[virtual_markers]\nChin = { vertex = 1, radius = 1, fixed = 'no' }\n", "must be true or false"),
        (LEAST + '"Lip" = { vertex = 12, radius = 1 }\n', "'Chin' and 'Lip' are both at vertex 12"),
        ("[settings]\nscale = 'FHL'\n" + LEAST, "scale must be a list of two markers"),
        ("[settings]\nscale = ['Chin', 'Lip']\n" + LEAST, "scale: 'Chin' is no fixed marker"),
        (f"[settings]\nsquint = 1{400 * '0'}\n" + LEAST, "too large"),
        ("[settings]\noverlap = 3\n" + LEAST, "overlap must be a word, not 3"),
        ("[settings]\nassignment = 'both'\n" + LEAST, "assignment must be one of shared, exclusive"),
        ("[settings]\nasignment = 'shared'\n" + LEAST, "settings: there is no 'asignment'"),
        ("settings = 1\n" + LEAST, "settings must be a table, not 1"),
        ("[head]\nname = 'a'\n" + LEAST, "head: connectivity must be a text, not None"),
        ("[heads]\nname = 'a'\n" + LEAST, "there is no table 'heads'"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_text(text)
    with pytest.raises(FormatError, match=words) as caught:
        read_mapping(path)
    assert str(caught.value).startswith(str(path))
