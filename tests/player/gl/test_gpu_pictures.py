"""Pictures are the same whoever deforms what they show; where a graphics card cannot, the processor does."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import graphics
import reference_cases
from fba.animation import Animation
from fba.errors import FbaWarning
from fba.player import Camera, CompareScene, Offscreen, Scene
from fba_player.gl.gpu._deformer import GpuDeformer
from fba_player.gl.gpu.way import Way
from fba_player.mesh.lazy_vertices import Places
from picture_difference import difference
from player_tracks import body_track, face_track
from reference_cases import Drawer, cases
from small_face import small_face

pytestmark = pytest.mark.usefixtures("opengl")
UInt8 = npt.NDArray[np.uint8]
MEAN, SPOT, BROAD = 0.1, 1.0, 0.15
"""Of CIEDE2000, see `picture_difference`: what smoothing whole pictures instead of outlines makes. Without it
they differ by one step of 255."""
WAYS = ("cpu", "gpu")
SHOWN = [
    "neutral_three_quarter", "fap_open_jaw", "fap_tongue", "fap_head", "expression_joy", "body_arms",
    "body_bow",
    "switch_wireframe", "switch_points", "switch_influence", "switch_glass", "switch_skeleton", "switch_grid",
    "switch_normals", "switch_no_shadows", "switch_no_eyes", "switch_no_teeth", "switch_no_hair",
    "switch_transparent", "points_face", "points_body",
]  # fmt: skip


def same(one: UInt8, other: UInt8) -> bool:
    found = difference(one, other)
    return found.mean <= MEAN and found.spot <= SPOT and found.broad <= BROAD


@pytest.fixture(scope="module")
def drawers(opengl: None) -> Iterator[dict[str, Drawer]]:
    """What draws the reference cases in each way."""
    with pytest.MonkeyPatch.context() as patch:
        found = {}
        for way in WAYS:
            found[way] = Drawer()
            for size in reference_cases.SIZES.values():
                found[way]._open[size] = Offscreen(cases()["neutral_front"].scene(), size, deform=way)
        patch.setattr(reference_cases, "Offscreen", None)  # no other is opened
        yield found
        for drawer in found.values():
            drawer.__exit__(None, None, None)


@pytest.mark.parametrize("name", SHOWN)
def test_reference_cases(drawers: dict[str, Drawer], name: str) -> None:
    case = cases()[name]
    one, other = (drawers[way](case) for way in WAYS)
    if drawers["gpu"]._open[case.size].scene.at(0.0).faces:
        assert drawers["gpu"]._open[case.size].deformed == ("gpu", "as wished")
    assert drawers["cpu"]._open[case.size].deformed == ("cpu", "as wished")
    assert same(one, other), difference(one, other)


def pictures(scene: Any, cameras: list[Camera | str], times: list[float]) -> dict[str, list[UInt8]]:
    """Of all cameras and times, in each way; by one sample a pixel."""
    found = {}
    for way in WAYS:
        with Offscreen(scene, (120, 90), deform=way) as view:
            shown = []
            for camera in cameras:
                view.camera = camera if isinstance(camera, Camera) else scene.camera(camera, 4 / 3)
                shown += [view.frame(time) for time in times]
            assert view.deformed[0] == way
            found[way] = shown
    return found


def test_levels_of_detail_come_and_go(walking: Animation) -> None:
    """Near, far, and near again: each level of each part has vertices of its own."""
    near = Camera((0.0, 1.6, 0.05), yaw=20.0, distance=0.5)
    cameras: list[Camera | str] = [near, "body", replace(near, distance=9.0), near]
    found = pictures(Scene(walking), cameras, [0.0, 0.3])
    for one, other in zip(found["cpu"], found["gpu"], strict=True):
        assert same(one, other), difference(one, other)
    assert all((found["gpu"][k] == found["gpu"][k + 6]).all() for k in (0, 1))  # nothing is left over
    assert not same(found["gpu"][0], found["gpu"][1])


@pytest.mark.parametrize("arrangement", ["side", "over"])
def test_several_figures(talking: Animation, walking: Animation, arrangement: str) -> None:
    scene = CompareScene([Scene(talking), Scene(walking), Scene(talking)], arrangement=arrangement)
    found = pictures(scene, ["front"], [0.1, 0.3])
    for one, other in zip(found["cpu"], found["gpu"], strict=True):
        assert same(one, other), difference(one, other)


def test_a_figure_twice_in_one_picture_in_two_poses(talking: Animation) -> None:
    """Both share their shapes, and so the buffers that are drawn."""
    shut = Animation(25, np.arange(10), face_track([{3: 0}] * 10), name="shut")  # type: ignore[arg-type]
    one, other = Scene(talking), Scene(shut)
    other._figure = one.figure
    found = pictures(CompareScene([one, other], names=("", "")), ["front"], [0.36])
    assert same(found["cpu"][0], found["gpu"][0])
    left, right = np.split(found["gpu"][0][20:70], 2, axis=1)
    assert not same(np.ascontiguousarray(left), np.ascontiguousarray(right))


def test_the_same_picture_from_run_to_run(talking: Animation) -> None:
    found = [pictures(Scene(talking), ["front"], [0.1, 0.3])["gpu"] for _ in range(2)]
    for one, other in zip(*found, strict=True):
        assert (one == other).all()


def small_scene(body: bool = False) -> Scene:
    faces = face_track([{3: 300, 49: 20000}, {3: 0}])
    with pytest.warns(FbaWarning):
        return Scene(
            Animation(25, np.arange(2), faces, body_track([{32: 40000}] * 2) if body else None),  # type: ignore[arg-type]
            small_face(),
        )


def test_software_is_left_to_the_processor(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("FBA_DEFORM", raising=False)
    with Offscreen(small_scene(), (48, 36)) as view:
        assert view.deformed == ("cpu", "nothing was drawn yet")
        view.draw(0.0)
        renderer = view._gl.info["GL_RENDERER"]
        assert view.deformed[0] == "cpu" or "llvmpipe" not in renderer


def test_a_card_is_measured_by_real_pictures(monkeypatch: pytest.MonkeyPatch, tmp_path: Any) -> None:
    monkeypatch.setenv("FBA_CACHE", str(tmp_path))
    monkeypatch.delenv("FBA_DEFORM", raising=False)
    monkeypatch.setattr("fba_player.gl.gpu.choice.is_software", lambda name: False)
    with Offscreen(small_scene(), (48, 36), deform="cpu") as view:
        wanted = view.frame(0.0)
    with Offscreen(small_scene(), (48, 36)) as view:
        found = view.frame(0.0)
        assert view.deformed[1].startswith("measured: ")
    assert same(wanted, found)
    assert len(list(tmp_path.rglob("deform-*.fbk"))) == 1


def broken(*_: object, **__: object) -> None:
    raise RuntimeError("the driver has\n  had enough")


@pytest.mark.parametrize(
    "method", ["__init__", "prepare", "rows", "write", "_move", "_of"], ids=lambda name: name.strip("_")
)
def test_what_fails_is_done_by_the_processor(monkeypatch: pytest.MonkeyPatch, method: str) -> None:
    scene = small_scene(body=True)
    with Offscreen(scene, (48, 36), deform="cpu") as view:
        wanted = view.frame(0.0)
    monkeypatch.setattr(GpuDeformer, method, broken)
    with Offscreen(scene, (48, 36), deform="gpu") as view:
        assert (view.frame(0.0) == wanted).all()
        assert view.deformed == ("cpu", "the graphics card cannot do it: the driver has had enough")
        assert (view.frame(0.0) == wanted).all()


def test_a_card_that_fails_later_is_replaced_within_the_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = small_scene(body=True)
    with Offscreen(scene, (48, 36), deform="cpu") as view:
        wanted = [view.frame(time) for time in (0.0, 0.04)]
    with Offscreen(scene, (48, 36), deform="gpu") as view:
        assert same(view.frame(0.0), wanted[0])
        assert view.deformed[0] == "gpu"
        monkeypatch.setattr(GpuDeformer, "write", broken)
        assert same(view.frame(0.04), wanted[1])
        assert view.deformed[0] == "cpu"
        assert (view.frame(0.0) == wanted[0]).all()


@pytest.mark.parametrize("order", [(1, 0), (0, 0)], ids=["places", "normals"])
def test_a_card_that_computes_wrongly_is_found_out(
    monkeypatch: pytest.MonkeyPatch, order: tuple[int, int]
) -> None:
    scene = small_scene()
    with Offscreen(scene, (48, 36), deform="cpu") as view:
        wanted = view.frame(0.0)
    original = GpuDeformer.write

    def swapped(self: GpuDeformer, places: Places, rows: Any, buffers: list[Any], light: Any) -> None:
        spare = [self._gl.buffer(reserve=buffer.size) for buffer in buffers]
        original(self, places, rows, spare, light)
        for buffer, other in zip(buffers, order, strict=False):
            buffer.write(spare[other].read())
        for buffer in spare:
            buffer.release()

    monkeypatch.setattr(GpuDeformer, "write", swapped)
    with Offscreen(scene, (48, 36), deform="gpu") as view:
        assert (view.frame(0.0) == wanted).all()
        assert view.deformed == ("cpu", "the graphics card cannot do it: vertices come out wrong")


def test_tables_that_no_texture_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = small_scene()
    with Offscreen(scene, (48, 36), deform="gpu") as view:
        monkeypatch.setitem(view._gl.info, "GL_MAX_TEXTURE_SIZE", 0)
        view.draw(0.0)
        assert view.deformed[0] == "cpu"
        assert "rows in a texture" in view.deformed[1]


def test_nothing_is_left_on_the_card() -> None:
    from fba_player.gl.context import offscreen_context

    scene = small_scene(body=True)
    context = offscreen_context()
    with context:
        way = Way(context, "gpu")
        bound = context.simple_framebuffer((4, 4))
        bound.use()
        for time in (0.0, 0.04):
            way.prepare(scene.at(time).faces, lambda faces: None)
            assert way.on_gpu
        assert context.fbo is bound
        deformer = way._deformer
        way.close()
        assert deformer is not None
        assert not deformer._tables
        assert not deformer._drawn
        assert context.error == "GL_NO_ERROR"
    context.release()


@pytest.mark.parametrize("way", WAYS)
def test_pictures_after_the_first_allocate_nothing(monkeypatch: pytest.MonkeyPatch, way: str) -> None:
    moderngl = graphics.imported("moderngl")
    scene = small_scene(body=True)
    with Offscreen(scene, (48, 36), deform=way) as view:
        for time in (0.0, 0.02, 0.04):
            view.draw(time)
        made: list[str] = []
        for name in ("buffer", "texture", "framebuffer", "vertex_array", "program"):
            monkeypatch.setattr(moderngl.Context, name, lambda *_, of=name, **__: made.append(of))
        for time in (0.01, 0.03, 0.04, 0.0):
            view.draw(time)
        assert not made
        assert view.deformed[0] == way


def test_another_word_is_refused() -> None:
    with pytest.raises(ValueError, match="auto, cpu, gpu"):
        Offscreen(small_scene(), (48, 36), deform="tpu")
