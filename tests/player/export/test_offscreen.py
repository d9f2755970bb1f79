"""Pictures: something is there, it is the right thing, and it is the same every time.

What stands still is still in pictures, and what moves slowly changes them evenly.
"""

import builtins
import sys
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import graphics
from fba.animation import Animation
from fba.errors import DisplayError
from fba.parameters import fap_numbers, point_rows
from fba.player import Camera, Offscreen, Scene
from fba_player.gl import _context as context
from player_tracks import body_track, face_track

SIZE = (640, 360)
SLOW = 400
"""Turn of the head in a frame, 1e-5 rad: eyes and mouth of a body 360 lines high move 1/15 of a pixel."""
REST = {"open_jaw": 200, "head_yaw": 0}
"""FAPs of all frames: a mouth a little open."""
BLOCK = 12
"""Size (pixels) of the blocks of a picture whose changes are compared: as wide as an eye and its lids."""
UInt8 = npt.NDArray[np.uint8]


def still(faps: dict[int, int] | None = None, baps: dict[int, int] | None = None) -> Animation:
    body = body_track([baps]) if baps is not None else None
    return Animation(25, np.arange(1), face_track([faps or {}]), body)  # type: ignore[arg-type]


def picture(animation: Animation, size: tuple[int, int] = (320, 240), **options: Any) -> UInt8:
    with Offscreen(animation, size, **options) as offscreen:
        return offscreen.frame(0.0)


def changed(a: UInt8, b: UInt8) -> npt.NDArray[np.bool_]:
    return np.abs(a.astype(int) - b.astype(int)).max(axis=2) > 8


@pytest.mark.usefixtures("opengl")
class TestPictures:
    def test_shape_and_opacity(self) -> None:
        shown = picture(still())
        assert shown.shape == (240, 320, 4)
        assert shown.dtype == np.uint8
        assert (shown[..., 3] == 255).all()

    def test_quality_is_fine_unless_the_scene_says_otherwise(self) -> None:
        fine, fast = picture(still()), picture(still(), samples=0)
        assert 20 < changed(fine, fast).sum() < 3000  # edges
        for quality, expected in (("fine", fine), ("fast", fast)):
            scene = Scene(still())
            scene.show("quality", quality)
            for samples in (0, 4):
                with Offscreen(scene, (320, 240), samples=samples) as offscreen:
                    np.testing.assert_array_equal(offscreen.frame(0.0), expected)

    def test_a_face_fills_the_middle_and_stands_upright(self) -> None:
        shown = picture(still(), camera="front").astype(int)
        red_over_blue = shown[..., 0] - shown[..., 2]
        assert red_over_blue[120:160, 140:180].mean() > 30  # skin
        assert abs(red_over_blue[:150, :20].mean()) < 25  # neutral studio
        assert shown[38:48, 150:170, :3].mean() < 150  # hair above
        assert shown[70:80, 150:170, :3].mean() > 150  # the forehead below it
        assert shown[-12:, 60:90, 2].mean() > shown[-12:, 60:90, 0].mean()  # a blue shirt below

    def test_the_same_time_gives_the_same_bytes(self, walking: Animation) -> None:
        runs = []
        for _ in range(2):
            with Offscreen(walking, (160, 120)) as offscreen:
                runs.append([offscreen.frame(t) for t in (0.0, 0.2, 0.1)])
                np.testing.assert_array_equal(offscreen.frame(0.2), runs[-1][1])
        np.testing.assert_array_equal(runs[0], runs[1])

    @pytest.mark.parametrize(
        ("faps", "between"),
        [
            ({3: 800, 5: -700, 10: -600, 11: -600}, ("9.3", 0.0, "2.10", -0.06)),
            ({19: 1024, 20: 1024}, ("4.3", 0.004, "5.3", 0.0)),
            ({31: 500, 32: 500, 33: 500}, ("11.1", 0.01, "3.3", 0.0)),
        ],
        ids=["jaw", "lids", "brows"],
    )
    def test_faps_change_the_part_they_move(
        self, faps: dict[int, int], between: tuple[str, float, str, float]
    ) -> None:
        scene = Scene(still())
        camera = scene.camera("front", 4 / 3)
        where = changed(picture(still(), camera=camera), picture(still(faps), camera=camera))
        rows = []
        for name, above in (between[:2], between[2:]):
            place = scene.model.points[point_rows()[name]] + (0, above, 0)
            clip = camera.projection_matrix(4 / 3) @ camera.view_matrix() @ [*place, 1.0]
            rows.append(round(120 * (1 - clip[1] / clip[3])))
        assert where.sum() > 30
        assert where[rows[0] : rows[1]].sum() > 0.95 * where.sum()

    def test_a_turned_head_looks_to_its_left(self) -> None:
        front, turned = (picture(still(faps), camera="front").astype(int) for faps in ({}, {49: 60000}))
        columns = np.arange(320)
        white = [((p[85:135, :, :3].min(axis=2) > 180) * columns).sum() for p in (front, turned)]
        count = [(p[85:135, :, :3].min(axis=2) > 180).sum() for p in (front, turned)]
        assert white[1] / count[1] > white[0] / count[0] + 8  # the eyes' whites move to the picture's right

    def test_a_body_stands_on_the_ground(self) -> None:
        shown = picture(still(baps={}), (240, 320), camera="body").astype(int)
        lifted = picture(still(baps={32: 150000}), (240, 320), camera="body").astype(int)
        assert changed(shown.astype(np.uint8), lifted.astype(np.uint8)).sum() > 100
        assert shown[250:300, 80:160, :3].min() < 70  # shoes and shadow

    @pytest.mark.parametrize("size", [(1, 1), (3, 2), (161, 91), (1, 50)])
    def test_any_size(self, size: tuple[int, int]) -> None:
        assert picture(still(), size).shape == (size[1], size[0], 4)

    def test_samples_agree_with_smoothing(self) -> None:
        several, one = (picture(still(), samples=n).astype(int) for n in (4, 0))
        assert np.abs(several - one).mean() < 1.5

    def test_cameras(self, talking: Animation) -> None:
        presets = [picture(talking, camera=name) for name in ("front", "three-quarter", "profile")]
        assert changed(presets[0], presets[1]).mean() > 0.05
        own = picture(talking, camera=Camera(distance=50.0))
        assert changed(own, presets[0]).mean() > 0.05
        with pytest.raises(ValueError, match="preset"):
            Offscreen(talking, camera="behind")

    def test_several_at_once_do_not_disturb_each_other(self, talking: Animation) -> None:
        alone = picture(talking, (64, 48))
        with Offscreen(talking, (64, 48)) as first, Offscreen(talking, (20, 20)) as second:
            second.frame(0.3)
            np.testing.assert_array_equal(first.frame(0.0), alone)
            second.close()
            np.testing.assert_array_equal(first.frame(0.0), alone)

    def test_no_opengl_error_is_left(self, walking: Animation) -> None:
        with Offscreen(walking, (64, 64)) as offscreen:
            offscreen.frame(0.0)
            with offscreen._gl:
                assert offscreen._gl.error == "GL_NO_ERROR"

    def test_closing_twice_and_drawing_after(self, talking: Animation) -> None:
        offscreen = Offscreen(talking, (8, 8))
        offscreen.close()
        offscreen.close()
        with pytest.raises(ValueError, match="closed"):
            offscreen.frame(0.0)

    def test_too_large_a_picture_is_refused(self, talking: Animation) -> None:
        with pytest.raises(DisplayError, match="smaller size"):
            Offscreen(talking, (1_000_000, 2))

    def test_extreme_values_draw(self) -> None:
        wild = {n: 1860 * (-1) ** n for n in range(3, 69)}
        assert picture(still(wild)).shape == (240, 320, 4)
        wild_body = {n: 10**6 * (-1) ** n for n in range(1, 187)}
        assert picture(still({}, wild_body)).shape == (240, 320, 4)


def test_sizes_and_times_are_checked(talking: Animation) -> None:
    with pytest.raises(ValueError, match="1x1"):
        Offscreen(talking, (0, 10))
    with pytest.raises(ValueError, match="finite"):
        Scene(talking).view_at(float("nan"))
    with pytest.raises(ValueError, match="no frames"):
        Scene(talking[0:0])


def test_missing_packages_and_drivers_are_named(talking: Animation, monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def without_moderngl(name: str, *rest: Any, **more: Any) -> Any:
        if name == "moderngl":
            raise ImportError("No module named 'moderngl'")
        return real(name, *rest, **more)

    with monkeypatch.context() as patch:
        patch.setattr(builtins, "__import__", without_moderngl)
        with pytest.raises(DisplayError, match="pip install moderngl"):
            Offscreen(talking, (4, 4))

    moderngl = graphics.imported("moderngl")

    def no_library(**options: Any) -> None:
        raise Exception("libEGL.so not found in /lib, /usr/lib")

    def old_driver(**options: Any) -> None:
        raise ValueError("Requested OpenGL version 330, got version 210")

    with monkeypatch.context() as patch:
        patch.setattr(context, "missing_libraries", list)  # whatever this machine has
        patch.setattr(moderngl, "create_context", no_library)
        with pytest.raises(DisplayError, match="apt-get install libegl1 libgl1"):
            Offscreen(talking, (4, 4))
        patch.setattr(moderngl, "create_context", old_driver)
        with pytest.raises(DisplayError, match=r"OpenGL 3\.3"):
            Offscreen(talking, (4, 4))


def test_importing_the_player_loads_no_opengl() -> None:
    import subprocess

    heavy = ("moderngl", "glfw", "av", "PIL", "scipy", "numpy")
    code = f"import sys, fba.player; print([m for m in {heavy} if m in sys.modules])"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


def pictures(faces: list[dict[str, int]], *, body: bool) -> npt.NDArray[np.int16]:
    """(T, H, W, 3): a picture of each frame, of the face, or of the whole body."""
    numbers, count = fap_numbers(), len(faces)
    posed = [{numbers[name]: value for name, value in {**REST, **row}.items()} for row in faces]
    bodies = body_track([{} for _ in faces]) if body else None
    animation = Animation(25, np.arange(count), face_track(posed), bodies)  # type: ignore[arg-type]
    try:
        with Offscreen(animation, SIZE) as view:
            return np.array([view.frame(number / 25)[..., :3] for number in range(count)], dtype=np.int16)
    except DisplayError as error:
        graphics.skip(str(error))
        raise


@pytest.mark.parametrize("body", [False, True])
def test_frames_of_equal_values_are_equal_to_the_last_pixel(body: bool) -> None:
    """Also where something else was shown between them: nothing is left of it."""
    first, again, other, last = pictures([{}, {}, {"head_yaw": 20000, "open_jaw": 700}, {}], body=body)
    assert (other != first).any()
    np.testing.assert_array_equal(again, first)
    np.testing.assert_array_equal(last, first)


def test_eyes_and_mouth_of_a_slowly_turning_head_do_not_tick() -> None:
    """Change of a frame: sum over all pixels of differences from the frame before. No frame changes more than
    1.35 times the mean of all; no block of 12 x 12 pixels with features (those that change by more than 1 of
    765 in the mean) more than 3 times its own mean.
    """
    frames = pictures([{"head_yaw": SLOW * number} for number in range(24)], body=True)
    steps = np.abs(np.diff(frames, axis=0)).sum(axis=3)
    whole = steps.sum(axis=(1, 2))
    assert whole.max() < 1.35 * whole.mean()
    moving = steps.mean(axis=0) > 0.5
    rows, columns = (np.flatnonzero(moving.any(axis=axis)) for axis in (1, 0))
    high, wide = (int(np.ptp(places)) // BLOCK for places in (rows, columns))
    head = steps[:, rows[0] : rows[0] + high * BLOCK, columns[0] : columns[0] + wide * BLOCK]
    blocks = head.reshape(len(steps), high, BLOCK, wide, BLOCK).mean(axis=(2, 4))
    inside = blocks.mean(axis=0) > 1.0
    assert inside.sum() >= 9
    worst = (blocks.max(axis=0) / np.maximum(blocks.mean(axis=0), 1e-9))[inside]
    assert worst.max() < 3.0
