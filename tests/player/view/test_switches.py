"""Switches: what they take, what they change in a view, and that the picture shows it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from fba.animation import Animation
from fba.body import BodyModel
from fba.face.deform._deformer import Deformer
from fba.face.model import FaceModel
from fba.parameters import point_rows
from fba.player import Camera, Offscreen, Scene
from fba_player._figure.face import FaceFigure, build_figure
from fba_player.gl._labels import place_names
from fba_player.scene._display_options import unique_edges
from fba_player.scene._fap_heatmap import FapHeatmap
from fba_player.scene.scene import SWITCHES
from fba_player.view.switches import Switches, parse_switch
from player_tracks import body_track, face_track

FLAGS_ON = ("wireframe", "points", "grid", "normals")


def face(faps: dict[int, int] | None = None) -> Animation:
    return Animation(25, np.arange(1), face_track([faps or {}]))  # type: ignore[arg-type]


def whole(faps: dict[int, int] | None = None, baps: dict[int, int] | None = None) -> Animation:
    return Animation(25, np.arange(1), face_track([faps or {}]), body_track([baps or {1: 0}]))  # type: ignore[arg-type]


@cache
def only_figure() -> FaceFigure:
    return build_figure(FaceModel.default())


@pytest.fixture
def figure() -> FaceFigure:
    return only_figure()


def shown(subject: Animation, view: str = "figure") -> Scene:
    """A scene whose face need not be made anew."""
    scene = Scene(subject, only_figure().model, view=view)
    scene.__dict__["figure"] = only_figure()
    return scene


class TestTable:
    def test_every_switch_says_what_it_is(self) -> None:
        assert set(SWITCHES) == {
            "wireframe", "points", "influence", "skeleton", "grid", "normals", "shadows", "wrinkles", "eyes",
            "teeth", "hair", "background", "lod", "quality", "contact", "relaxed",
        }  # fmt: skip
        keys = [switch.key for switch in SWITCHES.values() if switch.key]
        assert len(keys) == len(set(keys))
        for switch in SWITCHES.values():
            assert len(switch.description) > 10
            assert switch.parse(switch.default) == switch.default

    def test_values_are_checked_and_named(self) -> None:
        switches = Switches()
        assert switches.changed == {}
        switches.show("wireframe")
        switches.show("shadows", False)
        switches.show("influence", "raise_l_i_eyebrow")
        switches.show("skeleton", "only")
        assert switches.changed == {
            "wireframe": True, "shadows": False, "influence": 31, "skeleton": "only",
        }  # fmt: skip
        assert switches.version == 4
        assert switches.text("influence") == "raise_l_i_eyebrow"
        assert [switches.text(name) for name in ("eyes", "shadows", "background")] == ["on", "off", "studio"]
        switches.show("skeleton")
        assert switches["skeleton"] == "through"
        for name in switches.changed:
            switches.show(name, SWITCHES[name].default)
        assert switches.changed == {}

    @pytest.mark.parametrize(
        ("name", "value", "said"),
        [
            ("wirefame", True, "near: wireframe"),
            ("grid", "maybe", "on or off"),
            ("skeleton", "glass", "off, through, only"),
            ("influence", "open_jav", "near: open_jaw"),
            ("influence", 2, r"3\.\.68"),
            ("influence", 69, r"3\.\.68"),
            ("influence", True, "influence=open_jaw"),
            ("background", "green", "studio, grey, transparent"),
        ],
    )
    def test_what_does_not_exist_is_refused(self, name: str, value: Any, said: str) -> None:
        switches = Switches()
        with pytest.raises(ValueError, match=said):
            switches.show(name, value)
        assert switches.version == 0

    def test_as_a_command_writes_them(self) -> None:
        assert parse_switch("wireframe") == ("wireframe", True)
        assert parse_switch("eyes=off") == ("eyes", False)
        assert parse_switch("influence=open_jaw") == ("influence", 3)
        assert parse_switch("influence=48") == ("influence", 48)
        assert parse_switch("background = grey") == ("background", "grey")
        with pytest.raises(ValueError, match="no switch '"):
            parse_switch("=on")

    def test_keys_go_round(self) -> None:
        switches = Switches()
        seen = []
        for _ in range(4):
            switches.press("skeleton")
            seen.append(switches["skeleton"])
        assert seen == ["through", "only", "off", "through"]
        switches.press("wireframe")
        switches.press("influence")
        assert (switches["wireframe"], switches["influence"]) == (True, 3)


class TestViews:
    def test_lines_lie_along_the_edges_of_the_turned_head(self) -> None:
        faps = {3: 400, 48: 20000, 49: -40000}
        scene = shown(face(faps))
        scene.show("wireframe")
        ends = scene.view_at(0.0).extras.lines[0].ends  # type: ignore[union-attr]
        model = scene.model
        moved = Deformer(model)(scene.timeline.faps(0.0))
        skin = model.parts[0]
        above = skin.vertices[:, 1] > 0  # turns with the head, whole
        inside = above[skin.triangles].all(axis=1)
        expected = {
            tuple(sorted(edge)) for t in skin.triangles[inside] for edge in zip(t, np.roll(t, 1), strict=True)
        }
        starts = {tuple(np.round(pair, 5).ravel()) for pair in ends}
        found = sum(tuple(np.round(moved[list(edge)], 5).ravel()) in starts for edge in list(expected)[:400])
        assert found > 380  # rounding may part a few

    def test_edges_of_a_cube(self) -> None:
        quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], dtype=np.int32)
        edges = unique_edges(triangles)
        assert len(edges) == 18  # 12 sides and 6 diagonals
        assert (edges[:, 0] < edges[:, 1]).all()

    @pytest.mark.parametrize("subject", [face({3: 300}), whole({3: 300}, {49: 50000})], ids=["face", "whole"])
    def test_dots_stand_at_the_feature_points(self, subject: Animation) -> None:
        scene = shown(subject)
        scene.show("points")
        dots = scene.view_at(0.0).extras.dots[0]  # type: ignore[union-attr]
        marks = shown(subject, view="points").view_at(0.0).marks
        np.testing.assert_allclose(dots.positions, marks[:, :3], atol=1e-6)
        assert len(dots.names) == 84
        assert dots.names[0] == "2.1"

    def test_parts_are_taken_out(self) -> None:
        scene = shown(face())
        kinds = {mesh.shape.kind for mesh in scene.view_at(0.0).faces}
        assert {"skin", "teeth", "tongue", "lash"} <= kinds
        for name in ("eyes", "teeth", "hair"):
            scene.show(name, False)
        view = scene.view_at(0.0)
        assert view.eyes == []
        assert {mesh.shape.kind for mesh in view.faces} == {"skin", "other"}

    def test_without_shadows_light_is_everywhere_the_same(self) -> None:
        scene = shown(whole())
        assert len(scene.view_at(0.0).blobs) == 5
        scene.show("shadows", False)
        view = scene.view_at(0.0)
        assert len(view.blobs) == 0
        assert all((mesh.light == mesh.light[0]).all() for mesh in view.faces)

    def test_bones_alone_and_through_glass(self) -> None:
        scene = shown(whole())
        scene.show("skeleton", "only")
        alone = scene.view_at(0.0)
        assert (alone.faces, alone.eyes, alone.extras.shells) == ([], [], ())  # type: ignore[union-attr]
        joints = len(BodyModel.default().skeleton)
        head = 3  # the head's joint and two eyes
        assert len(alone.capsules) == 2 * joints - 1 + 2 * head - 1
        scene.show("skeleton", "through")
        glass = scene.view_at(0.0)
        np.testing.assert_array_equal(glass.capsules, alone.capsules)
        assert "skin" in {mesh.shape.kind for mesh in glass.extras.shells}  # type: ignore[union-attr]

    def test_a_face_turns_about_its_joints(self) -> None:
        scene = shown(face({49: 30000}))
        scene.show("skeleton", "only")
        places = scene.view_at(0.0).capsules[2:, :3]
        eyes = [eye.matrix[:3, 3] for eye in shown(face({49: 30000})).view_at(0.0).eyes]
        np.testing.assert_allclose(sorted(places[1:, 0]), sorted(e[0] for e in eyes), atol=1e-4)
        centre = scene.model.table_of[49].transforms[0].centre
        np.testing.assert_allclose(places[0], centre, atol=1e-6)  # stays where it is

    def test_the_grid_is_metres_on_the_floor(self) -> None:
        scene = shown(whole(baps={181: 500, 182: 0, 183: 0}))
        scene.show("grid")
        grid = scene.view_at(0.0).extras.grid  # type: ignore[union-attr]
        assert (grid.height, grid.step) == (0.0, 1.0)
        alone = shown(face())
        alone.show("grid")
        below = alone.view_at(0.0).extras.grid  # type: ignore[union-attr]
        assert below.step == pytest.approx(0.1)
        assert below.height == pytest.approx(alone.model.vertices[:, 1].min())

    def test_a_new_scene_has_no_extras(self) -> None:
        scene = shown(face())
        assert scene.view_at(0.0).extras is None
        scene.show("grid")
        scene.show("grid", False)
        assert scene.view_at(0.0).extras is None


class TestInfluence:
    def test_feature_points_move_by_their_faps_units(self, figure: FaceFigure) -> None:
        model = figure.model
        for number, unit, point in ((31, "ENS", "4.1"), (5, "MNS", "2.3"), (63, "ENS", "9.3")):
            vertex = model.bound[point_rows()[point]]
            moved = FapHeatmap(figure, number).distances[vertex]
            assert moved == pytest.approx(100 * model.fapu[unit], rel=0.002), number
        jaw = FapHeatmap(figure, 3)
        assert jaw.distances[model.bound[point_rows()["2.1"]]] > 100 * model.fapu.MNS  # on an arc
        assert (jaw.distances[model.vertices[:, 1] > 0] == 0).all()
        assert jaw.legend.title == "FAP 3 open_jaw"
        assert jaw.legend.most == pytest.approx(jaw.distances.max() * 1000)

    def test_a_turned_head_moves_most_where_it_is_furthest_from_its_axis(self, figure: FaceFigure) -> None:
        yaw, model = FapHeatmap(figure, 49), figure.model
        centre = model.table_of[49].transforms[0].centre
        nose = int(model.bound[point_rows()["9.3"]])
        arm = np.hypot(*(model.vertices[nose, [0, 2]] - np.array(centre)[[0, 2]]))
        assert yaw.distances[nose] == pytest.approx(2 * np.sin(0.05) * arm, rel=1e-4)
        assert yaw.distances[model.vertices[:, 1].argmin()] == pytest.approx(
            0.0, abs=1e-9
        )  # the shoulders stay
        assert "0.1 rad" in yaw.legend.unit

    def test_an_eye_turns(self, figure: FaceFigure) -> None:
        scene = shown(face())
        scene.show("influence", "yaw_l_eyeball")
        view = scene.view_at(0.0)
        assert view.eyes == []
        left, right = view.meshes
        assert np.ptp(left.shape.colours[:, :3], axis=0).max() > 0.3
        assert np.ptp(right.shape.colours[:, :3], axis=0).max() == 0

    def test_colours_are_those_of_the_legend(self, figure: FaceFigure) -> None:
        scene = shown(face())
        scene.show("influence", 3)
        view = scene.view_at(0.0)
        skin = next(mesh for mesh in view.faces if mesh.shape.name == "skin")
        legend = view.extras.legend  # type: ignore[union-attr]
        most = int(FapHeatmap(figure, 3).distances[: len(skin.positions)].argmax())
        linear = skin.shape.colours[most, :3]
        seen = np.where(linear < 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
        if FapHeatmap(figure, 3).distances.argmax() == most:
            np.testing.assert_allclose(seen, legend.stops[-1], atol=1e-3)
        still = int(skin.positions[:, 1].argmax())
        seen = 1.055 * skin.shape.colours[still, :3] ** (1 / 2.4) - 0.055
        np.testing.assert_allclose(seen, legend.stops[0], atol=1e-3)

    def test_a_fap_without_tables_moves_nothing(self) -> None:
        model = FaceModel.default()
        tables = tuple(table for table in model.tables if table.fap != 64)
        bare = FapHeatmap(build_figure(replace(model, tables=tables)), 64)
        assert bare.most == 0
        assert "moves no vertex" in bare.legend.unit


class TestNames:
    def test_each_finds_room_beside_its_dot(self) -> None:
        dots = np.array([[50.0, 50.0], [56.0, 50.0], [150.0, 80.0], [np.nan, np.nan], [198.0, 20.0]])
        sizes = np.full((5, 2), (30, 12))
        chosen, corners = place_names(dots, sizes, 3.0, (200, 100))
        assert 3 not in chosen
        assert {2, 4} <= set(chosen.tolist())
        boxes = np.concatenate([corners, corners + np.array([30, 12])], axis=1)
        assert (boxes[:, :2] >= 0).all()
        assert (boxes[:, 2:] <= (200, 100)).all()
        for i, a in enumerate(boxes):
            for b in boxes[i + 1 :]:
                assert not (a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3])

    def test_a_name_without_a_dot_stands_above_its_point(self) -> None:
        sizes = np.array([[30, 12]])
        for x, left in ((100.0, 85.0), (4.0, 0.0), (197.0, 170.0)):  # the last two would leave the picture
            _, corners = place_names(np.array([[x, 50.0]]), sizes, 0.0, (200, 100))
            assert corners.tolist() == [[left, 38.0]]

    def test_names_of_close_points_stand_in_rows(self) -> None:
        dots = np.array([[50.0, 50.0], [60.0, 50.0], [100.0, 50.0]])
        shown, corners = place_names(dots, np.full((3, 2), (30, 12)), 0.0, (200, 100))
        assert shown.tolist() == [0, 1, 2]
        assert corners.tolist() == [[35, 38], [45, 26], [85, 38]]

    def test_with_many_points_in_view_no_point_is_named(self) -> None:
        dots = np.stack(np.meshgrid(np.arange(10) * 40.0, np.arange(10) * 40.0), axis=-1).reshape(-1, 2)
        assert len(place_names(dots, np.full((100, 2), 10), 3.0, (400, 400))[0]) == 0


def pictures(subject: Animation, *switches: dict[str, Any], **more: Any) -> list[npt.NDArray[np.int64]]:
    scene = shown(subject)
    found = []
    with Offscreen(scene, more.pop("size", (240, 180)), **more) as offscreen:
        for chosen in switches:
            for name, value in chosen.items():
                scene.show(name, value)
            found.append(offscreen.frame(0.0).astype(int))
            for name in chosen:
                scene.show(name, SWITCHES[name].default)
        with offscreen._gl:
            assert offscreen._gl.error == "GL_NO_ERROR"
    return found


@pytest.mark.usefixtures("opengl")
class TestPictures:
    @pytest.mark.parametrize("subject", [face({3: 200}), whole({3: 200}, {32: 50000})], ids=["face", "whole"])
    def test_all_switches_on_and_off_again(self, subject: Animation) -> None:
        on: dict[str, Any] = dict.fromkeys(FLAGS_ON, True) | {"influence": 3, "background": "grey"}
        before, full, after = pictures(subject, {}, on, {})
        np.testing.assert_array_equal(before, after)
        assert (np.abs(full - before).max(axis=2) > 8).mean() > 0.2
        assert (full[..., 3] == 255).all()

    def test_wires_darken_the_head_alone(self) -> None:
        plain, wired, bare = pictures(face(), {}, {"wireframe": True}, {"eyes": False})
        darker = plain[..., :3].sum(axis=2) - wired[..., :3].sum(axis=2)
        assert darker[60:120, 90:150].mean() > 15
        assert (darker[:40, :40] == 0).all()
        assert (np.abs(plain - bare).max(axis=2) > 20).sum() > 30

    def test_a_transparent_background_is_not_there(self) -> None:
        grey, clear = pictures(face(), {"background": "grey"}, {"background": "transparent"}, samples=4)
        assert np.abs(grey[:20, :20, :3] - 127.5).max() < 1
        assert (clear[:20, :20, 3] == 0).all()
        solid = clear[..., 3] == 255
        assert solid[90:110, 110:130].all()
        np.testing.assert_allclose(clear[solid][:, :3], grey[solid][:, :3], atol=1)
        laid = clear[..., :3] * (clear[..., 3:] / 255) + 127.5 * (1 - clear[..., 3:] / 255)
        assert np.abs(laid - grey[..., :3]).max() < 3

    def test_shadows_on_a_clear_ground_are_half_there(self) -> None:
        (clear,) = pictures(whole(), {"background": "transparent"}, camera="body", size=(160, 240))
        alpha = clear[-60:, :, 3]
        assert ((alpha > 10) & (alpha < 200)).sum() > 100

    def test_grid_lines_lie_at_whole_metres(self) -> None:
        camera = Camera(target=(0.5, 0.0, 2.0), yaw=0.0, pitch=80.0, distance=6.0)
        plain, lined = pictures(whole(), {}, {"grid": True}, camera=camera, size=(400, 300))
        changed = np.abs(lined - plain)[..., :3].sum(axis=2)
        matrix = camera.projection_matrix(4 / 3) @ camera.view_matrix()

        def column(x: float, z: float) -> tuple[int, int]:
            clip = matrix @ [x, 0.0, z, 1.0]
            return round(200 * (1 + clip[0] / clip[3])), round(150 * (1 - clip[1] / clip[3]))

        for x in (0.0, 1.0):
            across, down = column(x, 2.35)
            assert changed[down, across - 2 : across + 3].max() > 40
            away, down = column(x + 0.25, 2.35)
            assert changed[down, away - 2 : away + 3].max() < 40

    def test_dots_are_drawn_round_where_their_points_are(self) -> None:
        scene = shown(face())
        camera = scene.camera("front", 4 / 3)
        plain, dotted = pictures(face(), {}, {"points": True}, camera=camera, size=(640, 480))
        matrix = camera.projection_matrix(4 / 3) @ camera.view_matrix()
        for name in ("9.3", "2.10", "11.1", "5.3", "4.3", "3.5"):
            clip = matrix @ [*scene.model.points[point_rows()[name]], 1.0]
            x, y = round(320 * (1 + clip[0] / clip[3])), round(240 * (1 - clip[1] / clip[3]))
            assert dotted[y, x, 0] > 220, name
            assert dotted[y, x, 2] < 110, name
        assert (np.abs(plain - dotted).max(axis=2) > 8).mean() < 0.02

    def test_a_legend_stands_in_the_corner_of_what_is_large_enough(self) -> None:
        plain, painted = pictures(face(), {}, {"influence": 3}, size=(480, 360))
        assert np.abs(painted - plain)[10:40, 10:100].max() > 60
        small, tiny = pictures(face(), {}, {"influence": 3}, size=(64, 48))
        assert np.abs(small - tiny)[:8, :8].max() == 0

    def test_glass_shows_the_bones_within(self) -> None:
        solid, glass, bones = pictures(
            whole(), {}, {"skeleton": "through"}, {"skeleton": "only"}, camera="body", size=(240, 320)
        )
        both = np.abs(bones - solid).max(axis=2) > 40
        assert both.mean() > 0.03
        orange = bones[..., 0] - bones[..., 2] > 60
        assert orange.sum() > 30
        assert (glass[..., 0] - glass[..., 2])[orange].mean() > 25
