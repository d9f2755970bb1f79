"""All windows for one task."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fba_player.session._marking import MARKING
from fba_player.session._page import Page
from fba_player.session._placing import PLACING

if TYPE_CHECKING:
    from fba_player.session._session import Session

PAGES: tuple[Page[Any], ...] = (PLACING, MARKING)


def page_of(session: Session) -> Page[Any] | None:
    """Return the page that the session's window is; None for a player of performances."""
    return next((page for page in PAGES if page.find(session) is not None), None)
