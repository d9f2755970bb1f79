"""Pictures of the player's window."""

from __future__ import annotations

import contextlib
import tempfile
import wave
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np

import fba
from fba.animation import Animation
from fba.arrays import UInt8
from fba.face import FaceModel, feature_point_names, resolve
from fba.face.importers.head_surface import read_head_surface
from fba.formats import merge, read_face
from fba.tracks import FaceTrack
from fba_player._ui.panels.puppet_panel import PuppetPanel
from fba_player.export._offscreen import Offscreen
from fba_player.scene._placement_scene import PlacementScene
from fba_player.scene._point_placement import PointPlacement
from fba_player.scene.compare import CompareScene
from fba_player.scene.markers_scene import MarkersScene
from fba_player.scene.scene import Scene
from fba_player.session._puppet import Expression
from fba_player.session._session import Session
from fba_player.session._source import Source
from fba_player.sound._peaks import Peaks
from pictures.marker_picture import edit
from tools.window_picture import SETTLES, Studio, picture

SAMPLES = Path(fba.__file__).resolve().with_name("samples")
SIZE = (1280, 720)
MOMENT, MARKS = 4.4, (2.0, 6.6)
"""What is shown, and the loop that is marked, seconds."""
COARSE = 31
"""Quantiser step of what is compared."""
CURVES = [3, 49, 31]
SPOKEN = (6, 10, 9, 5, 11, 0, 12, 4, 0, 7, 3, 13, 2, 1, 14, 0)
"""Visemes by number, one after the other."""
VISEME_SECONDS, SPOKEN_MOMENT = 0.24, 3.1
"""Seconds of each, and the moment that is shown."""
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


def wipe() -> UInt8:
    """Two faces on either side of a line, and how far each place of the second is from the first."""
    original = fba.read(SAMPLES / "hello.fap")
    coarse = fba.decode(fba.encode(original, fba.EncoderOptions(fap_quant=COARSE)))
    names, size = ["hello.fap", "coarse.fba"], (SIZE[0] // 2, 3 * SIZE[0] // 8)
    shown = []
    for arrangement in ("wipe", "colour"):
        scene = CompareScene([Scene(original), Scene(coarse)], arrangement=arrangement, names=names)
        with Offscreen(scene, size) as offscreen:
            shown.append(offscreen.draw(MOMENT))
    return np.concatenate(shown, axis=1)


def lanes() -> UInt8:
    """A stream of visemes and expressions with a sound, all made by hand, and curves that follow from it."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        animation = _speech()
        fba.write("speech.fba", animation)
        sound = _sound_of(animation, Path("speech.wav"))
        session = Session(
            Scene(fba.read("speech.fba")), source=Source(Scene(animation), "speech.fba"), size=SIZE
        )
        session.source.probe(wait=True)
        session.sound, session.lanes = sound, "all"
        session.transport.seek(SPOKEN_MOMENT)
        session.selection.choose([("measure", 1), ("viseme", 10), ("expression", 1)])
        with Peaks(sound) as session.peaks:
            session.peaks.start(wait=True)
            return picture(session, ("curves",))


def _speech() -> Animation:
    """Return visemes that pass into each other, with joy and surprise: eight seconds."""
    times = np.arange(8 * 25) / 25
    step, share = np.divmod(times, VISEME_SECONDS)
    spoken = np.array((*SPOKEN, *SPOKEN[:1]), np.int16)
    viseme, expression = np.zeros((len(times), 4), np.int16), np.zeros((len(times), 6), np.int16)
    at = step.astype(int) % len(SPOKEN)
    viseme[:, 0], viseme[:, 1] = spoken[at], spoken[at + 1]
    viseme[:, 2] = np.round(63 * (1 - share / VISEME_SECONDS))
    expression[:, 0], expression[:, 1] = 1, np.round(40 * np.sin(np.pi * times / 8) ** 2)
    expression[:, 2], expression[:, 3] = 6, np.round(50 * np.exp(-((times - 6) ** 2) * 2))
    mask = np.zeros((len(times), 68), bool)
    mask[:, :2] = True
    face = FaceTrack(np.zeros(mask.shape, np.int32), mask, viseme, expression)
    return Animation(Fraction(25), np.arange(len(times)), face, None, "speech")


def _sound_of(animation: Animation, path: Path) -> Path:
    """Write a tone that is loud while the mouth is open."""
    assert animation.face is not None
    rate = 16000
    jaw = np.abs(resolve(animation.face)[:, 2])
    times = np.arange(8 * rate) / rate
    loud = np.interp(times, animation.times, jaw / max(float(jaw.max()), 1.0))
    tone = np.sin(2 * np.pi * 140 * times) * loud * 20000
    with wave.open(str(path), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(rate)
        file.writeframes(tone.astype("<i2").tobytes())
    return path


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
