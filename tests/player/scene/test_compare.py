"""Several performances in one picture, and by how much they differ."""

from fractions import Fraction

import numpy as np
import pytest

from fba.animation import Animation
from fba_player.export._offscreen import Offscreen
from fba_player.gl._annotation_renderer import LEGEND_MARGIN, NAME_SIZE, REFERENCE_HEIGHT
from fba_player.gl._labels import legend_picture
from fba_player.playback._timeline import Timeline
from fba_player.playback._transport import Transport
from fba_player.scene._compare_timeline import CompareTimeline, differences
from fba_player.scene.compare import ROOTS, CompareScene, distances, round_up
from fba_player.scene.scene import Scene
from fba_player.view._geometry import project
from player_tracks import body_track, face_track


def talk(values: list[int], rate: int = 25, first: int = 0, name: str = "") -> Animation:
    index = np.arange(first, first + len(values))
    return Animation(Fraction(rate), index, face=face_track([{3: v} for v in values]), name=name)


def walk(angles: list[int], millimetres: int = 0) -> Animation:
    frames = [{32: angle, 181: millimetres * t} for t, angle in enumerate(angles)]
    return Animation(Fraction(25), np.arange(len(angles)), body=body_track(frames), name="walk")


def together(*animations: Animation) -> CompareTimeline:
    return CompareTimeline([Timeline(animation) for animation in animations])


@pytest.fixture(scope="module")
def pair() -> CompareScene:
    mouth = face_track([{3: 900, 4: -200, 5: -1200, 8: -200, 9: -200, 10: -1100, 11: -1100}] * 5)
    gaping = Animation(Fraction(25), np.arange(5), face=mouth, name="open")
    return CompareScene([Scene(talk([0] * 5, name="rest")), Scene(gaping)])


# --- times ---------------------------------------------------------------------------------------------


def test_frames_of_both_rates_are_on_one_line() -> None:
    timeline = together(talk([0] * 3, rate=10), talk([0] * 4, rate=15))  # 0 .1 .2 and 0 .0667 .1333 .2
    assert [timeline.time_of(n) for n in range(timeline.frames)] == [
        Fraction(0), Fraction(1, 15), Fraction(1, 10), Fraction(2, 15), Fraction(1, 5),
    ]  # fmt: skip
    assert (timeline.start, timeline.end) == (0, Fraction(3, 10))
    assert (timeline.position(0.1), timeline.position(0.05)[:2]) == ((2, 3, 0.0), (0, 1))
    assert timeline.position(99.0)[0] == 4
    with pytest.raises(ValueError, match="finite"):
        timeline.position(float("nan"))


def test_a_part_stands_where_it_was_cut_from() -> None:
    timeline = together(talk(list(range(100))), talk(list(range(50, 60)), first=50))
    assert timeline.later == (0, 0)
    assert timeline.timelines[1].faps(timeline.own_time(1, 2.2))[2] == 55


def test_recordings_of_different_hours_begin_together() -> None:
    hour = 25 * 3600
    timeline = together(talk([1, 2, 3], first=10 * hour), talk([4, 5, 6], first=11 * hour))
    assert (timeline.start, timeline.frames) == (36000, 3)
    assert timeline.timelines[1].faps(timeline.own_time(1, 36000.04))[2] == 5


def test_a_transport_plays_and_steps_over_all() -> None:
    timeline = together(talk([0] * 3, rate=10), talk([0] * 4, rate=15))
    now = [0.0]
    player = Transport(timeline, loop=True, clock=lambda: now[0])  # type: ignore[arg-type]
    player.step(1)
    assert player.time == pytest.approx(1 / 15)
    player.play()
    now[0] += 0.3
    assert player.time == pytest.approx(1 / 15)
    player.interpolate = False
    assert not any(one.interpolate for one in timeline.timelines)
    assert player.timecode(0.2) == "0:00:00:02"


# --- differences ---------------------------------------------------------------------------------------


def test_differences_frame_by_frame() -> None:
    found = differences(together(talk([0, 10, 20, 30]), talk([0, 13, 15, 30])))
    np.testing.assert_allclose(found.times, np.arange(4) / 25)
    np.testing.assert_array_equal(found.faps[:, 2], [0, 3, -5, 0])
    assert not np.delete(found.faps, 2, axis=1).any()
    worst = found.largest()
    assert [(one.kind, one.number, one.name, one.unit) for one in worst] == [("fap", 3, "open_jaw", "MNS")]
    assert (worst[0].most, worst[0].time) == (5.0, 0.08)
    assert worst[0].rms == pytest.approx(np.sqrt((9 + 25) / 4))


def test_differences_at_different_rates_are_between_frames() -> None:
    found = differences(together(talk([0, 100, 200], rate=10), talk([0, 50, 100, 150, 200, 250], rate=20)))
    np.testing.assert_allclose(found.times, [0.0, 0.05, 0.1, 0.15, 0.2])  # as long as both have frames
    np.testing.assert_allclose(found.faps[:, 2], 0, atol=1e-3)


def test_differences_of_bodies_have_units() -> None:
    found = differences(together(walk([0, 1000]), walk([0, 4000], millimetres=7)))
    assert found.baps[1, [31, 180]].tolist() == [3000, 7]
    units = {(one.kind, one.number): one.unit for one in found.largest()}
    assert units == {("bap", 32): "1e-5 rad", ("bap", 181): "mm"}
    nods = [Animation(Fraction(25), np.arange(1), face=face_track([{48: angle}])) for angle in (0, 1000)]
    assert [one.unit for one in differences(together(*nods)).largest()] == ["1e-5 rad"]  # head_pitch
    assert [one.number for one in found.largest(1)] == [32]


def test_a_face_and_a_body_have_no_differences() -> None:
    found = differences(together(talk([5, 5]), walk([7, 7])))
    assert not found.faps.any()
    assert not found.baps.any()
    assert found.largest() == []
    with pytest.raises(ValueError, match="performance 2"):
        differences(together(talk([5]), talk([5])), 2)


# --- pictures ------------------------------------------------------------------------------------------


def test_two_heads_stand_apart_and_are_those_of_their_scenes(pair: CompareScene) -> None:
    camera = pair.camera("front")
    view = pair.view_at(0.0)
    alone = [scene.view_at(0.0) for scene in pair.scenes]
    assert len(view.faces) == sum(len(one.faces) for one in alone)
    assert len(view.eyes) == 4
    middles = [float(eye.matrix[0, 3]) for eye in view.eyes]
    assert max(middles[:2]) < -0.05 < 0.05 < min(middles[2:])  # the first on the left
    assert camera.target[0] == pytest.approx(0.0, abs=0.01)
    count = len(alone[0].faces)
    for mesh, own in zip(view.faces[count:], alone[1].faces, strict=True):
        np.testing.assert_array_equal(mesh.positions, own.positions)
    assert [dots.names for dots in view.extras.dots] == [("rest", "open")]  # type: ignore[union-attr]


def test_in_profile_they_stand_beside_each_other_as_the_camera_sees_them(pair: CompareScene) -> None:
    camera = pair.camera("profile")
    matrix = camera.projection_matrix(16 / 9) @ camera.view_matrix()
    places = [matrix @ eye.matrix[:, 3] for eye in pair.view_at(0.0).eyes]
    across = [float(place[0] / place[3]) for place in places]
    assert max(across[:2]) < -0.1
    assert min(across[2:]) > 0.1


def test_over_each_other_the_second_is_a_drawing(pair: CompareScene) -> None:
    pair.arrangement = "over"
    try:
        view = pair.view_at(0.0)
        assert len(view.faces) == len(pair.scenes[0].view_at(0.0).faces)
        assert view.meshes
        assert all((mesh.shape.colours[:, :3] == mesh.shape.colours[0, :3]).all() for mesh in view.meshes)
        assert pair.view_at(0.04).meshes[0].shape is view.meshes[0].shape  # renderers keep what they know
        assert pair.scenes[1].view == "figure"
    finally:
        pair.arrangement = "side"
    with pytest.raises(ValueError, match="arrangement"):
        pair.arrangement = "behind"


def test_switches_and_views_are_those_of_all(pair: CompareScene) -> None:
    pair.show("eyes", False)
    pair.view = "points"
    try:
        assert [scene.switches["eyes"] for scene in pair.scenes] == [False, False]
        assert [scene.view for scene in pair.scenes] == ["points", "points"]
    finally:
        pair.show("eyes", True)
        pair.view = "figure"
    assert (pair.title, pair.has_body) == ("rest | open", False)


def test_a_head_beside_a_body_is_as_high_as_its_head() -> None:
    scene = CompareScene([Scene(walk([0, 0])), Scene(talk([0, 0]))])
    scene.camera("front")
    heights = [float(eye.matrix[1, 3]) for eye in scene.view_at(0.0).eyes]
    assert heights[2] == pytest.approx(heights[0], abs=0.02)
    assert heights[0] > 1.4


def test_heads_and_bodies_in_a_row_are_all_in_the_picture() -> None:
    scene = CompareScene([Scene(talk([0, 0])), Scene(talk([0, 0])), Scene(walk([0, 0])), Scene(talk([0, 0]))])
    camera, aspect = scene.camera(None, 16 / 9), 16 / 9
    matrix = camera.projection_matrix(aspect) @ camera.view_matrix()
    across = []
    for eye in scene.view_at(0.0).eyes[::2]:
        clip = matrix @ eye.matrix[:, 3]
        across.append(float(clip[0] / clip[3]))
    apart = np.diff(across)
    assert (apart > 0).all()
    assert apart[1] > 1.3 * apart[0]  # a body has more room than a head
    shoulders = 0.25 * float(matrix[0, 0]) / camera.distance
    assert across[0] - shoulders > -1
    assert across[-1] + shoulders < 1


@pytest.mark.parametrize("preset", [None, "front", "body", "profile"])
def test_bodies_that_were_recorded_anywhere_stand_beside_each_other(preset: str | None) -> None:
    """The second one, at BAPs 182 and 183: 3 m aside, and 2 m back."""
    away = Animation(Fraction(25), np.arange(2), body=body_track([{182: 3000, 183: -2000}] * 2), name="away")
    scene = CompareScene([Scene(walk([0, 0])), Scene(away), Scene(walk([0, 0]))])
    matrix = scene.camera(preset, 16 / 9).view_matrix()
    across, _, depth, _ = np.array([matrix @ eye.matrix[:, 3] for eye in scene.view_at(0.0).eyes[::2]]).T
    apart = np.diff(across)
    assert apart == pytest.approx(apart[0], abs=0.02)
    assert apart[0] > 0.4
    assert depth == pytest.approx(depth[0], abs=0.02)


def test_no_scene_and_too_few_names_are_refused(pair: CompareScene) -> None:
    with pytest.raises(ValueError, match="no scene"):
        CompareScene([])
    with pytest.raises(ValueError, match="names"):
        CompareScene(pair.scenes, names=["one"])
    with pytest.raises(ValueError, match="preset"):
        pair.camera("nowhere")


def test_both_figures_are_in_the_picture(pair: CompareScene, opengl: None) -> None:
    with Offscreen(pair, (320, 180), "front") as offscreen:
        picture = offscreen.frame(0.0)[..., :3].astype(int)
    red = picture[..., 0] - picture[..., 2] > 25  # skin
    assert red[:, :160].sum() > 2000
    assert red[:, 160:].sum() > 2000
    assert red[:, [0, -1]].sum() < 40  # and nobody is cut off at the sides
    mouths = picture[90:150, :160], picture[90:150, 160:]  # only the right one is open, and dark inside
    skins = red[90:150, :160], red[90:150, 160:]
    shades = [half[skin].sum(axis=1) for half, skin in zip(mouths, skins, strict=True)]
    dark = [float(np.percentile(shade, 2)) for shade in shades]
    assert dark[1] < 0.8 * dark[0]


def test_of_many_parts_every_one_hides_what_is_behind_it(opengl: None) -> None:
    with Offscreen(CompareScene([Scene(walk([0])), Scene(walk([0]))]), (320, 180), "front") as offscreen:
        picture = offscreen.frame(0.0)[..., :3].astype(int)
    counts = [(half[..., 0] - half[..., 2] > 50).sum() for half in (picture[:, :160], picture[:, 160:])]
    assert min(counts) > 0.9 * max(counts) > 1000  # skin: the second head is not seen from within


def test_colours_are_of_the_distance_from_the_first(pair: CompareScene) -> None:
    pair.arrangement = "colour"
    try:
        view = pair.view_at(0.0)
        count = len(pair.scenes[0].view_at(0.0).faces)
        painted = view.faces[count:]
        assert all(mesh.looks is None for mesh in view.faces[:count])
        legend = view.extras.legend
        own = pair.scenes[1].view_at(0.0).faces
        away = distances(own, pair.scenes[0].view_at(0.0).faces, np.zeros(3))
        most = max(float(each.max()) for each in away)
        assert most <= legend.most / 1000 < 2.5 * most
        parts = {mesh.shape.name: mesh for mesh in painted}
        moved = {mesh.shape.name: each for mesh, each in zip(own, away, strict=True)}
        skin = max(moved, key=lambda name: float(moved[name].max()))
        looks = parts[skin].looks
        still, far = looks[moved[skin] == 0, :3], looks[moved[skin].argmax(), :3]
        assert (still == still[0]).all()
        assert np.abs(far - still[0]).max() > 0.2
        assert pair.view_at(0.04).faces[-1].shape is view.faces[-1].shape  # renderers keep what they know
    finally:
        pair.arrangement = "side"


def test_names_stand_below_the_legend_of_colours(pair: CompareScene) -> None:
    pair.arrangement = "colour"
    try:
        camera, size = pair.camera("front"), (1280, REFERENCE_HEIGHT)
        extras = pair.view_at(0.1).extras
    finally:
        pair.arrangement = "side"
    assert extras.legend is not None
    low = LEGEND_MARGIN + legend_picture(extras.legend, 1.0).shape[0]
    pixels = project(extras.dots[-1].positions.astype(float), camera.clip_matrix(size), size)[0]
    assert pixels[:, 1].min() - 1.35 * NAME_SIZE > low  # a name is above its point


def test_a_wipe_shows_each_on_its_side_of_the_line(pair: CompareScene) -> None:
    pair.arrangement = "wipe"
    size = (160, 120)
    try:
        pictures = {}
        for at in (0.0, 0.5, 1.0):
            pair.wipe = at
            with Offscreen(pair, size) as offscreen:
                pictures[at] = offscreen.draw(0.0).astype(int)
        line = slice(78, 82)
        for half, whole in ((slice(2, 76), 1.0), (slice(84, 158), 0.0)):
            assert np.abs(pictures[0.5][:, half] - pictures[whole][:, half]).max() <= 2
            assert np.ptp(pictures[0.5][:, half], axis=1).max() > 60  # a figure, not only the backdrop
        assert np.abs(pictures[0.0][:, 10:150] - pictures[1.0][:, 10:150]).max() > 60
        assert (pictures[0.5][:, line].min(axis=(0, 2)) > 200).any()
    finally:
        pair.arrangement, pair.wipe = "side", 0.5


def test_a_common_root_is_that_of_the_first() -> None:
    scene = CompareScene([Scene(walk([0] * 5, 100)), Scene(walk([0] * 5, 300))])
    scene.arrangement = "wipe"
    apart = {}
    for root in ROOTS:
        scene.root = root
        for time in (0.0, 0.16):
            view = scene.view_at(time)
            eyes = [each.eyes[0].matrix[:3, 3] for each in (view, view.wipe.view)]
            apart[root, time] = float(np.linalg.norm(eyes[1] - eyes[0]))
    own = apart["own", 0.16] - apart["own", 0.0]
    assert abs(own) > 0.1
    assert apart["common", 0.16] == pytest.approx(apart["common", 0.0], abs=1e-6)


@pytest.mark.parametrize(
    ("distance", "rounded"), [(0.0, 1e-5), (0.0011, 0.002), (0.004, 0.005), (0.6, 1.0), (2.0, 2.0)]
)
def test_scales_are_round(distance: float, rounded: float) -> None:
    assert round_up(distance) == pytest.approx(rounded)


def test_figures_posed_beside_each_other_are_as_alone(pair: CompareScene) -> None:
    """Also a scene that is shown twice, which has one pose at a time."""
    for scenes in (pair.scenes, (pair.scenes[1], pair.scenes[1])):
        shown = CompareScene(scenes).view_at(0.1).faces
        alone = [mesh.positions for scene in scenes for mesh in scene.view_at(0.1).faces]
        for mesh, positions in zip(shown, alone, strict=True):
            np.testing.assert_array_equal(mesh.positions, positions)
