"""An `Offscreen` holds its memory, draws any size, anywhere, and says clearly what it cannot do."""

import gc
import sys
import threading
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import graphics
from fba.animation import Animation
from fba.errors import DisplayError, FbaWarning
from fba.player import Offscreen, Scene
from fba_player.gl import _context as context
from fba_player.scene.scene import SWITCHES
from player_tracks import body_track, face_track
from small_face import small_face

TINY = (16, 12)
ROUNDS = 5
MOST_GROWTH = 200_000
"""Bytes by which memory may grow in every round."""
MOST_BLOCKS = 100
"""Blocks of Python's memory that may be added in every round: fewer than a leak of two for each picture."""


def small_scene(view: str = "figure", *, body: bool = False) -> Scene:
    """A face of few vertices that moves for two seconds."""
    faces = face_track([{3: 60 * (t % 8), 23: 6000 * (t % 5), 49: 2000 * (t % 7)} for t in range(50)])
    bodies = body_track([{32: 9000 * (t % 9), 8: 5000 * (t % 4)} for t in range(50)]) if body else None
    with warnings.catch_warnings(action="ignore", category=FbaWarning):  # it has no teeth
        return Scene(Animation(25, np.arange(50), faces, bodies, "small"), small_face(), view=view)  # type: ignore[arg-type]


def resident() -> int:
    """Bytes of this process in memory."""
    gc.collect()
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * 4096


def assert_every_round_holds_memory(draw_all: Callable[[], None], living: Callable[[], int]) -> None:
    """Run `draw_all` several times; in one of them at least, memory must not grow.

    What leaks grows in every round; a heap, a driver's thread or a free list grows in one of them.
    """
    alive = living()
    growths, more_blocks = [], []
    for _ in range(ROUNDS):
        before, blocks = resident(), sys.getallocatedblocks()
        draw_all()
        assert living() == alive
        growths.append(resident() - before)
        more_blocks.append(sys.getallocatedblocks() - blocks)
    assert min(growths) < MOST_GROWTH, growths
    assert min(more_blocks) < MOST_BLOCKS, more_blocks


@pytest.fixture
def living(monkeypatch: pytest.MonkeyPatch) -> Callable[[], int]:
    """How many things of OpenGL were made since and not given back."""
    moderngl = graphics.imported("moderngl")
    made: list[Any] = []

    def kept(make: Callable[..., Any]) -> Callable[..., Any]:
        def make_and_keep(*arguments: Any, **options: Any) -> Any:
            made.append(make(*arguments, **options))
            return made[-1]

        return make_and_keep

    for name in (
        "buffer",
        "texture",
        "renderbuffer",
        "depth_renderbuffer",
        "framebuffer",
        "vertex_array",
        "program",
    ):
        monkeypatch.setattr(moderngl.Context, name, kept(getattr(moderngl.Context, name)))

    def count() -> int:
        made[:] = [one for one in made if not isinstance(one.mglo, moderngl.InvalidObject)]
        return len(made)

    return count


@pytest.mark.usefixtures("opengl")
@pytest.mark.skipif(sys.platform != "linux", reason="resident memory is read from /proc")
class TestMemory:
    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("view", "body", "pictures"), [("figure", False, 300), ("points", False, 40), ("figure", True, 40)]
    )
    def test_hundreds_of_pictures_leave_no_objects(
        self, view: str, body: bool, pictures: int, living: Callable[[], int]
    ) -> None:
        """pictures: in each round."""
        with Offscreen(small_scene(view, body=body), TINY) as offscreen:

            def draw_all() -> None:
                for t in range(pictures):
                    offscreen.draw(t % 600 / 300)

            for _ in range(2):  # until the heap has found its size
                draw_all()
            assert living() > 20
            assert_every_round_holds_memory(draw_all, living)
        assert living() == 0

    @pytest.mark.slow
    def test_switches_and_cameras_leave_no_objects(self, living: Callable[[], int]) -> None:
        scene = small_scene()
        values = {"wireframe": True, "points": True, "influence": 3, "normals": True, "grid": True,
                  "skeleton": "through", "background": "grey", "eyes": False, "shadows": False}  # fmt: skip
        with Offscreen(scene, (32, 24)) as offscreen:

            def switch_all() -> None:
                for step in range(8):
                    for name, value in values.items():
                        scene.show(name, 3 + step % 60 if name == "influence" else value)
                        offscreen.camera = offscreen.camera.orbit(7.0, 1.0)
                        offscreen.draw(step % 20 / 10)
                        scene.show(name, SWITCHES[name].default)

            for number in range(512):  # each gets a shape of its own, until the caches of shapes are full
                scene.show("influence", 3 + number % 2)
                offscreen.draw(0.0)
                scene.show("influence", SWITCHES["influence"].default)
            switch_all()
            assert_every_round_holds_memory(switch_all, living)
        assert living() == 0

    def test_opening_and_closing_leaves_no_objects(self) -> None:
        scene = small_scene()

        def open_and_close() -> None:
            with Offscreen(scene, TINY) as offscreen:
                offscreen.draw(0.0)

        for _ in range(4):
            open_and_close()
        before = resident()
        for _ in range(10):
            open_and_close()
        assert resident() - before < 4_000_000  # a driver keeps a little; a context has more


@pytest.mark.usefixtures("opengl")
class TestSizes:
    @pytest.mark.parametrize("view", ["figure", "points"])
    @pytest.mark.parametrize("size", [(1, 1), (2, 1), (1, 301), (333, 1), (127, 63), (241, 137)])
    @pytest.mark.parametrize("samples", [0, 4])
    def test_any(self, size: tuple[int, int], view: str, samples: int) -> None:
        scene = small_scene(view)
        scene.show("points")
        with Offscreen(scene, size, samples=samples) as offscreen:
            drawn = offscreen.frame(0.4)
            assert drawn.shape == (size[1], size[0], 4)
            assert (drawn[..., 3] == 255).all()
            with offscreen._gl:
                assert offscreen._gl.error == "GL_NO_ERROR"

    def test_4k_is_the_same_picture_larger(self) -> None:
        scene = small_scene()
        with Offscreen(scene, (3840, 2160), "front") as large, Offscreen(scene, (384, 216), "front") as small:
            fine, coarse = large.frame(0.4), small.frame(0.4)
        mean = fine[..., :3].reshape(216, 10, 384, 10, 3).mean(axis=(1, 3))
        apart = np.abs(mean - coarse[..., :3]).max(axis=2)
        assert np.median(apart) < 2
        assert (apart > 30).mean() < 0.02  # edges alone

    @pytest.mark.parametrize("size", [(0, 5), (5, 0), (-3, 4)])
    def test_sizes_below_one_pixel_are_refused(self, size: tuple[int, int]) -> None:
        with pytest.raises(ValueError, match="1x1"):
            Offscreen(small_scene(), size)

    def test_too_much_is_refused_and_leaves_nothing(self) -> None:
        scene = small_scene()
        with pytest.raises(DisplayError, match="at most"):
            Offscreen(scene, (2_000_000, 1))
        with Offscreen(scene, TINY) as offscreen:
            assert offscreen.frame(0.0).shape == (12, 16, 4)


@pytest.mark.usefixtures("opengl")
class TestSeveral:
    def test_two_renderers_in_turns_draw_what_one_draws(self) -> None:
        scene = small_scene()
        with Offscreen(scene, (48, 36)) as alone:
            expected = [alone.frame(t / 10) for t in range(5)]
        with Offscreen(scene, (48, 36)) as one, Offscreen(small_scene("points"), (30, 50)) as other:
            for t, picture in enumerate(expected):
                other.frame(t / 10)
                np.testing.assert_array_equal(one.frame(t / 10), picture)

    def test_after_closing_it_says_so(self) -> None:
        offscreen = Offscreen(small_scene(), TINY)
        assert offscreen.frame(0.0).any()
        offscreen.close()
        offscreen.close()
        uses: list[Callable[[], object]] = [
            lambda: offscreen.frame(0.0),
            lambda: offscreen.draw(0.0),
            lambda: offscreen.still(np.zeros(68)),
        ]
        for use in uses:
            with pytest.raises(ValueError, match="closed"):
                use()

    def test_a_failure_while_drawing_leaves_it_usable(self) -> None:
        scene = small_scene()
        with Offscreen(scene, TINY) as offscreen:
            before = offscreen.frame(0.0)
            with pytest.raises(ValueError, match="finite"):
                offscreen.frame(float("inf"))
            with pytest.raises(ValueError, match="shape"):
                offscreen.still(np.zeros(67))
            np.testing.assert_array_equal(offscreen.frame(0.0), before)

    def test_in_threads(self) -> None:
        with Offscreen(small_scene(), (48, 36)) as here:
            expected = [here.frame(t / 10) for t in range(8)]
            found: dict[int, list[Any]] = {}
            scenes = [small_scene() for _ in range(2)]

            def draw(number: int) -> None:
                with Offscreen(scenes[number], (48, 36)) as own:
                    found[number] = [own.frame(t / 10) for t in range(8)]

            threads = [threading.Thread(target=draw, args=(n,)) for n in range(2)]
            for thread in threads:
                thread.start()
            again = [here.frame(t / 10) for t in range(8)]
            for thread in threads:
                thread.join(120)
        assert sorted(found) == [0, 1]
        for pictures in (again, *found.values()):
            np.testing.assert_array_equal(pictures, expected)

    def test_made_here_and_used_in_a_thread(self) -> None:
        found: list[Any] = []
        with Offscreen(small_scene(), TINY) as offscreen:
            expected = offscreen.frame(0.2)
            thread = threading.Thread(target=lambda: found.append(offscreen.frame(0.2)))
            thread.start()
            thread.join(120)
            np.testing.assert_array_equal(found[0], expected)
            np.testing.assert_array_equal(offscreen.frame(0.2), expected)


@pytest.mark.parametrize(
    ("failure", "words"),
    [
        ("libEGL.so: cannot open shared object file", ("libegl1", "libgl1", "apt-get install")),
        ("libGL.so not found in /usr/lib", ("libegl1", "libgl1", "apt-get install")),
        ("eglGetDisplay failed (0x3000)", ("libegl1", "libgl1-mesa-dri", "DISPLAY")),
        ("(standalone) XOpenDisplay: cannot open display", ("libegl1", "DISPLAY")),
        ("Requested OpenGL version 330, got version 210", ("OpenGL 3.3", "driver")),
    ],
)
def test_without_opengl_it_says_what_to_do(
    failure: str, words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    moderngl = graphics.imported("moderngl")

    def refuse(**options: Any) -> None:
        raise RuntimeError(failure)

    monkeypatch.setattr(moderngl, "create_context", refuse)
    monkeypatch.setattr(context, "missing_libraries", list)  # whatever this machine has
    with pytest.raises(DisplayError) as told:
        Offscreen(small_scene(), TINY)
    for word in words:
        assert word in str(told.value)
