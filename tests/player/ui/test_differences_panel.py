"""The panel of differences, drawn into memory."""

from collections.abc import Iterator
from fractions import Fraction

import numpy as np
import pytest

import graphics
from fba.animation import Animation
from fba_player.playback._transport import Transport
from fba_player.scene.compare import CompareScene
from fba_player.scene.scene import Scene
from fba_player.session._session import Session
from player_tracks import body_track, face_track
from studio_hand import panel_of

graphics.imported("imgui_bundle")

from fba_player._ui._docks import EDGE  # noqa: E402
from fba_player._ui._hud import BUTTONS_HEIGHT  # noqa: E402
from fba_player._ui.panels._differences_panel import DifferencesPanel, _shown, thin_curve  # noqa: E402 - needs imgui
from studio_hand import StudioHand  # noqa: E402
from tools.window_picture import Studio  # noqa: E402

SIZE = (900, 640)


def talk(values: list[int]) -> Animation:
    return Animation(Fraction(10), np.arange(len(values)), face=face_track([{3: v, 18: 5} for v in values]))


@pytest.fixture
def studio(opengl: None) -> Iterator[Studio]:
    scene = CompareScene(
        [Scene(talk([0, 10, 20, 30])), Scene(talk([0, 10, 90, 30]))], names=["a.fba", "b.fba"]
    )
    session = Session(scene, Transport(scene.timeline, clock=lambda: 0.0), size=SIZE)  # type: ignore[arg-type]
    with Studio(session) as made:
        yield made


def test_a_row_takes_to_where_the_difference_is_largest(studio: Studio) -> None:
    studio.session.open.add("differences")
    picture = studio.draw(6)
    panel = picture[60:600, 520:886, :3].astype(int)
    accent = (abs(panel - (92, 173, 230)).sum(axis=2) < 60).sum()
    assert accent > 100  # the curve and the heading
    StudioHand(studio).click(600.0, 186.0)
    assert studio.session.transport.time == pytest.approx(0.2)


def test_angles_are_shown_in_degrees() -> None:
    factor, unit = _shown("1e-5 rad")
    assert (round(factor * 174533, 2), unit) == (100.0, "deg")
    assert _shown("MNS") == (1.0, "MNS")


def test_it_is_there_only_where_something_is_compared(opengl: None) -> None:
    panel, alone = DifferencesPanel(), Scene(talk([0, 1]))
    assert not panel.available(Session(alone, Transport(alone.timeline)))
    pair = CompareScene([alone, alone])
    assert panel.available(Session(pair, Transport(pair.timeline)))  # type: ignore[arg-type]


def test_a_long_curve_keeps_its_peaks() -> None:
    values = np.zeros(100_000)
    values[[7, 50_123, 99_999]] = (5.0, -8.0, 3.0)
    times, shown = thin_curve(np.arange(100_000) / 25, values, 500)
    assert (len(times), shown.max(), shown.min()) == (500, 5.0, -8.0)
    assert times[int(shown.argmin())] == 50_123 / 25
    assert (np.diff(times) > 0).all()
    short = np.arange(3.0)
    assert thin_curve(short, short, 3)[0] is short


def test_curves_of_the_second_performance_are_shown_on_demand(studio: Studio) -> None:
    session = studio.session
    session.selection.faps = [3]
    session.open.add("curves")
    studio.draw(4)
    panel = panel_of(studio, "curves")
    assert panel._lanes[0].course.values.tolist() == [0, 10, 20, 30]
    panel.which = 1
    studio.draw(4)
    assert panel._lanes[0].course.values.tolist() == [0, 10, 90, 30]


def test_files_made_from_a_comparison_bear_both_names(studio: Studio) -> None:
    assert studio.session.source.stem == "a-b"


def test_the_mouse_shows_that_the_line_of_a_wipe_can_be_dragged(studio: Studio) -> None:
    studio.session.scene.arrangement = "wipe"  # type: ignore[attr-defined]
    for x, cursor in ((SIZE[0] / 2, "resize_ew"), (SIZE[0] / 4, "arrow")):
        studio.gui.io.add_mouse_pos_event(x, 200.0)
        studio.settle(3)
        assert studio.gui.cursor == cursor


def test_the_file_panel_describes_each_file(studio: Studio) -> None:
    from fba_player._ui.panels._file_panel import _sections

    told = _sections(studio.session, studio.session.source.info)
    assert [title for title, _ in told] == ["1  a.fba", "2  b.fba"]
    assert [row for row in told[0][1] if row[0] != "duration"] == [
        ("frames", "4"),
        ("rate", "10 frames/s"),
        ("FAPs", "2: 3, 18"),
    ]


def test_why_nothing_differs() -> None:
    from fba_player._ui.panels._differences_panel import _why_nothing_differs

    rest = body_track([{32: 0}] * 4)
    face, body = Scene(talk([0] * 4)), Scene(Animation(Fraction(10), np.arange(4), body=rest))
    for scene, said in (
        (CompareScene([face, face]), "nothing differs"),
        (CompareScene([face, body]), "one is a face, the other a body"),
    ):
        assert _why_nothing_differs(scene, 1, scene.differences()).startswith(said)


@pytest.mark.parametrize("size", [(900, 640), (1280, 720), (640, 400)])
def test_names_stand_below_the_buttons_of_the_panels(studio: Studio, size: tuple[int, int]) -> None:
    session = studio.session
    session.size = size
    session.viewpoint.aspect = size[0] / size[1]
    studio.draw(4)
    captions = session.scene.view_at(0.0).extras
    at = captions.dots[-1].positions
    clip = session.camera(0.0).clip_matrix(size) @ np.column_stack([at, np.ones(len(at))]).T
    assert ((1 - clip[1] / clip[3]) / 2 * size[1] > EDGE + BUTTONS_HEIGHT + 9).all()  # half a name
