"""Pictures of the player's window."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from pathlib import Path

from make_marker_picture import edit

import fba
from fba.animation import Animation
from fba.arrays import UInt8
from fba.face import FaceModel, feature_point_names
from fba.face.importers.head_surface import read_head_surface
from fba.formats import merge, read_face
from fba_player._ui.panels.puppet_panel import PuppetPanel
from fba_player.scene._placement_scene import PlacementScene
from fba_player.scene._point_placement import PointPlacement
from fba_player.scene.compare import CompareScene
from fba_player.scene.markers_scene import MarkersScene
from fba_player.scene.scene import Scene
from fba_player.session._puppet import Expression
from fba_player.session._session import Session
from fba_player.session._source import Source
from tools.window_picture import SETTLES, Studio, picture

SAMPLES = Path(fba.__file__).resolve().with_name("samples")
SIZE = (1280, 720)
MOMENT, MARKS = 4.4, (2.0, 6.6)
"""What is shown, and the loop that is marked, seconds."""
COARSE = 31
"""Quantiser step of what is compared."""
CURVES = [3, 49, 31]
MOVED = {3: 420.0, 15: -120.0}
"""FAPs whose curves are shown, and those moved by hand."""


def window() -> UInt8:
    """A face and a body: what the stream holds, curves, marks."""
    face, body = fba.read(SAMPLES / "hello.fap"), fba.read(SAMPLES / "hello.bvh")
    with _played(merge(face, body.resample(face.rate))) as session:
        session.transport.mark_in, session.transport.mark_out = MARKS
        return picture(session, ("file", "curves"))


def panels() -> UInt8:
    """Curves, bit rate, and a face moved by hand."""
    with _played(fba.read(SAMPLES / "hello.fap")) as session:
        session.source.probe(wait=True)
        session.open |= {"curves", "rate", "puppet"}
        session.selection.faps = CURVES
        with Studio(session) as studio:
            studio.draw(SETTLES)
            panel = next(one for one in studio.gui.panels if isinstance(one, PuppetPanel))
            puppet = panel.performer(session).puppet
            puppet.expression = Expression(1, 45)
            for number, value in MOVED.items():
                puppet.move_fap(number, value)
            studio.draw(1)
            return studio.draw(SETTLES)


def compare() -> UInt8:
    """Two performances over each other, and the panel of their differences."""
    original = fba.read(SAMPLES / "hello.fap")
    coarse = fba.decode(fba.encode(original, fba.EncoderOptions(fap_quant=COARSE)))
    names = ["hello.fap", "coarse.fba"]
    scene = CompareScene([Scene(original), Scene(coarse)], arrangement="over", names=names)
    session = Session(scene, size=SIZE)
    session.open.add("differences")
    session.transport.seek(MOMENT)
    with Studio(session) as studio:
        return studio.draw(2 * SETTLES)


def points() -> UInt8:
    """The built-in head as if only its eyes were known."""
    head = FaceModel.default()
    known = {
        name: int(vertex)
        for name, vertex in zip(feature_point_names(), head.bound, strict=True)
        if vertex >= 0 and name.startswith("3.")
    }
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scan.glb"
        head.save(path)
        placement = PointPlacement(read_head_surface(path, points=known), "scan.points.csv")
    placement.choose("9.3")
    session = Session(PlacementScene(placement), size=SIZE)
    return picture(session, ("points",))


def markers() -> UInt8:
    """Markers beside the built-in head, and the reach of one of them."""
    editing = edit(read_face(SAMPLES / "talk.c3d"))
    editing.choose("LPB")
    session = Session(MarkersScene(editing, "talk.c3d"), size=SIZE)
    return picture(session, ("markers",))


@contextlib.contextmanager
def _played(animation: Animation) -> Iterator[Session]:
    """A session that plays the animation from a stream with an I plane every two seconds."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        path = Path("hello.fba")
        fba.write(path, animation, intra_period=2, bap_steps="visage")
        scene = Scene(fba.read(path, bap_steps="visage"))
        session = Session(scene, source=Source(scene, path, bap_steps="visage"), size=SIZE)
        session.transport.seek(MOMENT)
        yield session
