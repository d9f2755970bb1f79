"""Actions of a window by name, for keys, buttons and menus."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from fba_player.session._session import LANES, Session

FOLLOW_TEXTS = {None: "by itself", "hips": "the hips", "head": "the head", "none": "nothing"}
"""What the camera follows, as users read it."""
LANE_TEXTS = {"content": "what is said, felt and heard", "all": "all", "none": "none"}
"""Lanes of the timeline, as users read it."""
ZOOM = 0.5
"""Factor on the time that the timeline shows, for one key press."""
PAGE = 0.8
"""Share of the time shown by which one key press moves it."""
SOUND_SHIFT = 0.02
"""Seconds by which one key press shifts the sound."""


def act(session: Session, name: str) -> bool:
    """Do an action of the table of keys, such as "toggle", "camera front" or "panel file".

    Returns whether it exists.
    """
    word, _, rest = name.partition(" ")
    if rest and word in _ACTIONS_WITH_NAME:
        _ACTIONS_WITH_NAME[word](session, rest)
    elif not rest and word in _ACTIONS:
        _ACTIONS[word](session)
    else:
        return False
    return True


def _mark_in(session: Session) -> None:
    session.transport.mark_in = session.transport.time


def _mark_out(session: Session) -> None:
    session.transport.mark_out = session.transport.time


def _interpolate(session: Session) -> None:
    transport = session.transport
    transport.interpolate = not transport.interpolate
    session.say("smooth between frames" if transport.interpolate else "frame by frame", about="motion")


def _follow(session: Session) -> None:
    """Follow the next of what there is to follow."""
    order = list(FOLLOW_TEXTS)
    now = session.viewpoint.follow
    _follow_that(session, order[(order.index(now) + 1) % len(order)])


def _follow_that(session: Session, what: str | None) -> None:
    session.viewpoint.follow = what
    session.say(f"the camera follows: {FOLLOW_TEXTS[what]}", about="camera")


def _orbit(session: Session) -> None:
    session.viewpoint.toggle_orbit()
    session.say("the camera turns" if session.scene.orbit else "the camera stays", about="camera")


def _lanes(session: Session) -> None:
    session.lanes = LANES[(LANES.index(session.lanes) + 1) % len(LANES)]
    if session.memory is not None:
        session.memory.welcome()  # who has found the lanes needs no hint at them
    session.say(f"lanes of the timeline: {LANE_TEXTS[session.lanes]}", about="lanes")


def _zoom(session: Session, factor: float) -> None:
    time = session.transport.time
    session.zoom.zoom(factor, min(max(time, session.zoom.low), session.zoom.high))


def _turn_page(session: Session, pages: float) -> None:
    session.zoom.pan(pages * PAGE * (session.zoom.high - session.zoom.low))


def _mute(session: Session) -> None:
    if session.audio is None:
        what = "there is no sound" if session.sound is None else "there is no sound device"
        session.say(what, "warning")
        return
    session.audio.muted = not session.audio.muted
    session.say("sound off" if session.audio.muted else "sound on", about="mute")


def _shift_sound(session: Session, seconds: float) -> None:
    if session.sound is None:
        session.say("there is no sound", "warning")
        return
    session.shift_sound(seconds)
    now = session.sound_offset
    begins = f"{abs(now):.2f} s {'later' if now > 0 else 'earlier'}" if now else "with the first frame"
    session.say(f"sound {begins}", about="sound")


def _bare(session: Session) -> None:
    session.bare = not session.bare


_ACTIONS: dict[str, Callable[[Session], None]] = {
    "toggle": lambda session: session.transport.toggle(),
    "stop": lambda session: session.transport.stop(),
    "back": lambda session: session.transport.step(-1),
    "on": lambda session: session.transport.step(1),
    "back10": lambda session: session.transport.step(-10),
    "on10": lambda session: session.transport.step(10),
    "first": lambda session: session.transport.first(),
    "last": lambda session: session.transport.last(),
    "mark_in": _mark_in,
    "mark_out": _mark_out,
    "clear_marks": lambda session: session.transport.clear_marks(),
    "loop": lambda session: session.transport.toggle_loop(),
    "faster": lambda session: session.transport.faster(),
    "slower": lambda session: session.transport.slower(),
    "normal_speed": lambda session: session.transport.set_speed(1.0),
    "interpolate": _interpolate,
    "reset_view": lambda session: session.viewpoint.reset(),
    "follow": _follow,
    "orbit": _orbit,
    "copy_command": partial(Session.request, what="copy_command"),
    "points": Session.toggle_view,
    "mute": _mute,
    "sound_earlier": partial(_shift_sound, seconds=-SOUND_SHIFT),
    "sound_later": partial(_shift_sound, seconds=SOUND_SHIFT),
    "bare": _bare,
    "lanes": _lanes,
    "zoom_in": partial(_zoom, factor=ZOOM),
    "zoom_out": partial(_zoom, factor=1 / ZOOM),
    "zoom_fit": lambda session: session.zoom.reset(),
    "page_back": partial(_turn_page, pages=-1),
    "page_on": partial(_turn_page, pages=1),
    "close": Session.leave,
    "escape": Session.escape,
    **{
        name: partial(Session.request, what=name)
        for name in ("screenshot", "transparent", "record", "fullscreen")
    },
}
_ACTIONS_WITH_NAME: dict[str, Callable[[Session, str], None]] = {
    "camera": lambda session, name: session.viewpoint.preset(name),
    "panel": Session.toggle_panel,
    "follow": lambda session, name: _follow_that(session, None if name == "itself" else name),
}
