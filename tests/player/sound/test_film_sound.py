"""Films of the window carry what was heard, when it was heard; read back from the file."""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from fba.animation import Animation
from fba_player.playback._transport import Transport
from fba_player.scene.scene import Scene
from fba_player.session._captures import FILM_RATE, Captures
from fba_player.session._session import Session
from fba_player.sound.soundtrack import FilmSound
from player_tracks import face_track
from set_clock import Clock
from sound_clicks import click_time, sound, write_click

av = pytest.importorskip("av")

RATE = FILM_RATE
"""Pictures a second of the window: each is a frame of the film."""
CLICK = 0.5
"""Seconds in the sound."""
EXACT = 0.006
"""Seconds: AAC blurs a click."""


class Filmed:
    """A session that is recorded picture by picture, without a window."""

    def __init__(self, folder: Path, wav: Path | None) -> None:
        animation = Animation(Fraction(25), np.arange(75), face=face_track([{3: 1}] * 75), name="talk")
        self.clock = Clock(100.0)
        scene = Scene(animation)
        transport = Transport(scene.timeline, loop=False, clock=self.clock)
        self.session = Session(scene, transport, size=(32, 32), clock=self.clock)
        self.session.sound = wav
        self.captures = Captures(self.session, folder)
        self.captures.toggle_recording()

    def go_on(self, seconds: float, slowness: float = 1.0) -> None:
        """Draw seconds of the film. slowness: seconds that the machine takes for each of them."""
        pixels = np.zeros((32, 32, 4), np.uint8)
        for _ in range(round(seconds * RATE)):
            self.clock.now += slowness / RATE
            self.captures.begin_picture()
            self.captures.add_picture(lambda: lambda: pixels)

    def film(self) -> Path:
        path = self.captures.close()
        assert path is not None
        return path


@pytest.fixture
def filmed(tmp_path: Path) -> Callable[[], Filmed]:
    return lambda: Filmed(tmp_path, write_click(tmp_path / "talk.wav", CLICK, seconds=3.0, rate=16000))


def test_what_is_played_is_heard_when_it_was_seen(filmed: Callable[[], Filmed]) -> None:
    one = filmed()
    one.go_on(0.3)  # paused
    one.session.transport.play()
    one.go_on(0.9)
    path = one.film()
    assert click_time(path) == pytest.approx(0.3 + CLICK, abs=EXACT)
    _, samples, rate = sound(path)
    assert rate == 16000
    with av.open(str(path)) as film:
        shown = [float(frame.time) for frame in film.decode(video=0)]
    assert len(samples) / rate == pytest.approx(shown[-1] + 1 / 30, abs=2 * 1024 / rate)
    assert shown[-1] == pytest.approx(1.2, abs=0.04)


def test_a_slow_machine_makes_the_same_film(filmed: Callable[[], Filmed]) -> None:
    """Where a picture took 0.08 s, the film had 13 pictures a second; now what is shown slows down."""
    one = filmed()
    one.go_on(0.3, slowness=2.4)
    one.session.transport.play()
    one.go_on(0.9, slowness=2.4)
    assert one.session.recording == pytest.approx(1.2)
    assert one.session.recording_speed == pytest.approx(1 / 2.4)
    assert one.session.transport.time == pytest.approx(0.9)
    path = one.film()
    assert one.session.clock is one.clock  # time goes on as before
    one.clock.now += 0.5
    assert one.session.transport.time == pytest.approx(1.4)
    assert click_time(path) == pytest.approx(0.3 + CLICK, abs=EXACT)
    with av.open(str(path)) as film:
        assert [round(frame.time * RATE) for frame in film.decode(video=0)] == list(range(36))


def test_a_jump_while_playing_is_heard_as_a_jump(filmed: Callable[[], Filmed]) -> None:
    one = filmed()
    one.session.transport.seek(1.0)
    one.session.transport.play()
    one.go_on(0.4)
    one.session.transport.seek(0.3)
    one.go_on(0.5)
    assert click_time(one.film()) == pytest.approx(0.4 + CLICK - 0.3, abs=EXACT)


def test_a_film_has_the_sound_at_the_speed_played(filmed: Callable[[], Filmed]) -> None:
    one = filmed()
    one.session.transport.set_speed(0.5)
    one.session.transport.play()
    one.go_on(1.3)
    assert click_time(one.film()) == pytest.approx(2 * CLICK, abs=EXACT)


def test_the_offset_moves_it(filmed: Callable[[], Filmed]) -> None:
    one = filmed()
    one.session.shift_sound(0.25)
    one.session.transport.play()
    one.go_on(1.0)
    assert click_time(one.film()) == pytest.approx(CLICK + 0.25, abs=EXACT)


def test_a_film_without_sound_has_no_track(tmp_path: Path) -> None:
    one = Filmed(tmp_path, None)
    one.go_on(0.2)
    with av.open(str(one.film())) as film:
        assert not film.streams.audio
        assert film.streams.video


def test_sound_that_cannot_be_read_leaves_the_film_silent_and_says_so(tmp_path: Path) -> None:
    broken = tmp_path / "talk.wav"
    broken.write_bytes(b"no sound at all")
    one = Filmed(tmp_path, broken)
    one.go_on(0.2)
    assert [notice.kind for notice in one.session.notices()] == ["warning"]
    with av.open(str(one.film())) as film:
        assert not film.streams.audio


def test_a_muted_film_is_silent(tmp_path: Path) -> None:
    wav = write_click(tmp_path / "talk.wav", 0.1)
    animation = Animation(Fraction(25), np.arange(75), face=face_track([{3: 1}] * 75))
    clock = Clock(0.0)
    transport = Transport(Scene(animation).timeline, clock=clock)
    transport.play()
    for muted, loudest in ((True, 0.0), (False, 30000 / 32768)):
        transport.seek(0.0)
        heard = FilmSound(wav, transport, muted=lambda muted=muted: muted)  # type: ignore[misc]
        clock.now += 0.5
        heard.advance(0.5)
        heard.end()
        samples = np.concatenate([frame.to_ndarray()[0] for frame in heard.frames(30000)])
        heard.close()
        assert len(samples) == 30000  # what is not there yet is silence, once it has ended
        assert float(np.abs(samples).max()) == pytest.approx(loudest, abs=1e-3)


def test_the_encoder_takes_what_is_there(tmp_path: Path) -> None:
    wav = write_click(tmp_path / "talk.wav", 0.1, rate=11000)  # AAC does not know that rate
    animation = Animation(Fraction(25), np.arange(75), face=face_track([{3: 1}] * 75))
    heard = FilmSound(wav, Transport(Scene(animation).timeline))
    assert heard.rate == 48000
    heard.advance(0.1)
    assert sum(frame.samples for frame in heard.frames(48000)) == 4800
    assert list(heard.frames(48000)) == []
    heard.close()
