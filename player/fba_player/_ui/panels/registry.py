"""The list of panels, in the order of their buttons."""

from __future__ import annotations

from fba_player._ui.panels._curves_panel import CurvesPanel
from fba_player._ui.panels._differences_panel import DifferencesPanel
from fba_player._ui.panels._file_panel import FilePanel
from fba_player._ui.panels._files_panel import FilesPanel
from fba_player._ui.panels._page_panels import MarkersPanel, PhotosPanel, PointsPanel
from fba_player._ui.panels._rate_panel import RatePanel
from fba_player._ui.panels._view_panel import CameraPanel, HelpPanel, ViewPanel
from fba_player._ui.panels.panel import Panel
from fba_player._ui.panels.puppet_panel import PuppetPanel

PANELS: tuple[type[Panel], ...] = (
    FilePanel, FilesPanel, ViewPanel, CameraPanel, CurvesPanel, RatePanel, PuppetPanel, DifferencesPanel,
    HelpPanel,
)  # fmt: skip


PAGES: dict[str, tuple[type[Panel], ...]] = {
    "points": (PointsPanel,), "markers": (MarkersPanel, CameraPanel), "photos": (PhotosPanel,),
}  # fmt: skip
"""Panels of windows for one task, by the name of the page's own panel."""


def make_panels(page: str = "") -> list[Panel]:
    """Make one object of each panel. page: name of a page's panel, for a window of one task."""
    return [kind() for kind in (PAGES[page] if page else PANELS)]
