"""Windows for one task, in which clicks and keys have meanings of their own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fba_player.session import marking, placing

if TYPE_CHECKING:
    from fba_player.session.session import Session


@dataclass(frozen=True)
class Page:
    """A window for one task.

    panel: name of the panel that belongs to it. click: does what a click at a pixel means. press_key: does
    what a key means, and returns whether it has a meaning. keeps: whether an action of the table of keys
    keeps its key. plays: whether the timeline and the buttons of panels are shown.
    """

    panel: str
    click: Callable[[Session, float, float], None]
    press_key: Callable[[Session, str], bool]
    keeps: Callable[[str], bool]
    plays: bool


PLACING = Page(
    "points",
    placing.click_on_head,
    placing.press_key,
    lambda action: action.split()[0] in placing.KEPT_ACTIONS,
    plays=False,
)
MARKING = Page(
    "markers",
    marking.click_on_picture,
    marking.press_key,
    lambda action: not action.startswith(marking.OTHER_ACTIONS),
    plays=True,
)


def page_of(session: Session) -> Page | None:
    """The page that the session's window is; None for a player of performances."""
    if placing.placement_of(session) is not None:
        return PLACING
    return MARKING if marking.editing_of(session) is not None else None
