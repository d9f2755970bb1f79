"""Actions of a window by name, for keys, buttons and menus."""

from __future__ import annotations

from collections.abc import Callable

from fba_player.session.session import Session

SHIFT = 0.02
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


def _toggle(session: Session) -> None:
    session.transport.toggle()


def _stop(session: Session) -> None:
    session.transport.stop()


def _first(session: Session) -> None:
    session.transport.first()


def _last(session: Session) -> None:
    session.transport.last()


def _mark_in(session: Session) -> None:
    session.transport.mark_in = session.transport.time


def _mark_out(session: Session) -> None:
    session.transport.mark_out = session.transport.time


def _clear_marks(session: Session) -> None:
    session.transport.clear_marks()


def _loop(session: Session) -> None:
    session.transport.toggle_loop()


def _faster(session: Session) -> None:
    session.transport.faster()


def _slower(session: Session) -> None:
    session.transport.slower()


def _normal_speed(session: Session) -> None:
    session.transport.set_speed(1.0)


def _interpolate(session: Session) -> None:
    transport = session.transport
    transport.interpolate = not transport.interpolate
    session.say("smooth between frames" if transport.interpolate else "frame by frame", about="motion")


def _reset_view(session: Session) -> None:
    session.viewpoint.reset()


def _follow(session: Session) -> None:
    session.viewpoint.toggle_follow(session.transport.time)
    session.say("the camera follows" if session.viewpoint.follow else "the camera stays", about="camera")


def _points(session: Session) -> None:
    session.toggle_view()


def _mute(session: Session) -> None:
    if session.audio is None:
        what = "there is no sound" if session.sound is None else "there is no sound device"
        session.say(what, "warning")
        return
    session.audio.muted = not session.audio.muted
    session.say("sound off" if session.audio.muted else "sound on", about="mute")


def _shift_sound(seconds: float) -> Callable[[Session], None]:
    def shift(session: Session) -> None:
        if session.sound is None:
            session.say("there is no sound", "warning")
            return
        session.shift_sound(seconds)
        now = session.sound_offset
        way = f"{abs(now):.2f} s {'later' if now > 0 else 'earlier'}" if now else "with the first frame"
        session.say(f"sound {way}", about="sound")

    return shift


def _bare(session: Session) -> None:
    session.bare = not session.bare


def _close(session: Session) -> None:
    session.leave()


def _escape(session: Session) -> None:
    session.escape()


def _step(frames: int) -> Callable[[Session], None]:
    return lambda session: session.transport.step(frames)


def _request(what: str) -> Callable[[Session], None]:
    return lambda session: session.request(what)


_ACTIONS: dict[str, Callable[[Session], None]] = {
    "toggle": _toggle,
    "stop": _stop,
    "back": _step(-1),
    "on": _step(1),
    "back10": _step(-10),
    "on10": _step(10),
    "first": _first,
    "last": _last,
    "mark_in": _mark_in,
    "mark_out": _mark_out,
    "clear_marks": _clear_marks,
    "loop": _loop,
    "faster": _faster,
    "slower": _slower,
    "normal_speed": _normal_speed,
    "interpolate": _interpolate,
    "reset_view": _reset_view,
    "follow": _follow,
    "points": _points,
    "mute": _mute,
    "sound_earlier": _shift_sound(-SHIFT),
    "sound_later": _shift_sound(SHIFT),
    "bare": _bare,
    "close": _close,
    "escape": _escape,
    **{name: _request(name) for name in ("screenshot", "transparent", "record", "fullscreen")},
}
_ACTIONS_WITH_NAME: dict[str, Callable[[Session, str], None]] = {
    "camera": lambda session, name: session.viewpoint.preset(name),
    "panel": lambda session, name: session.toggle_panel(name),
}
