"""What a session says, for how long, and what it takes to close it over unsaved work."""

from __future__ import annotations

import pytest

from fba.animation import Animation
from fba.player import Scene
from fba_player.session._session import Session
from set_clock import Clock


@pytest.fixture
def session(talking: Animation) -> Session:
    return Session(Scene(talking), clock=Clock())


def later(session: Session, seconds: float) -> None:
    assert isinstance(session.clock, Clock)
    session.clock.now += seconds


def test_closing_again_within_six_seconds_discards(session: Session) -> None:
    """Time to read the warning; after that, somebody may have forgotten it."""
    session.unsaved = {"the take"}
    session.leave()
    assert not session.closing
    later(session, 6.1)
    session.leave()
    assert not session.closing
    assert [notice.text for notice in session.notices()] == ["Unsaved: the take. Close again to discard"]
    later(session, 5.9)
    session.leave()
    assert session.closing


def test_without_unsaved_work_it_closes_at_once(session: Session) -> None:
    session.leave()
    assert session.closing


def test_a_notice_stays_four_seconds_and_fades_in_the_last_half(session: Session) -> None:
    assert not session.restless
    session.say("Saved")
    later(session, 3.4)
    assert not session.restless
    later(session, 0.2)  # it fades: new pictures are needed
    assert session.restless
    assert len(session.notices()) == 1
    later(session, 0.5)
    assert session.notices() == []
    assert not session.restless


def test_the_mouse_cursor_hides_after_three_idle_seconds_of_playing(session: Session) -> None:
    session.touched()
    later(session, 3.1)
    assert not session.hides_mouse
    session.transport.play()
    session.touched()
    later(session, 2.9)
    assert not session.hides_mouse
    later(session, 0.2)
    assert session.hides_mouse
    session.touched()
    assert not session.hides_mouse
