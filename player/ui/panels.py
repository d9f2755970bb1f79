"""The panels that there are, in the order of their buttons."""

from __future__ import annotations

from player.ui.camera_panel import CameraPanel
from player.ui.curves_panel import CurvesPanel
from player.ui.differences_panel import DifferencesPanel
from player.ui.file_panel import FilePanel
from player.ui.help_panel import HelpPanel
from player.ui.panel import Panel
from player.ui.puppet_panel import PuppetPanel
from player.ui.rate_panel import RatePanel
from player.ui.view_panel import ViewPanel

PANELS: tuple[type[Panel], ...] = (
    FilePanel,
    ViewPanel,
    CameraPanel,
    CurvesPanel,
    RatePanel,
    PuppetPanel,
    DifferencesPanel,
    HelpPanel,
)


def make_panels() -> list[Panel]:
    """One object of each."""
    return [kind() for kind in PANELS]
