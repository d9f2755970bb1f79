"""D: the panel of differences between animations that are compared, by parameter and over time."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from imgui_bundle import imgui, implot

from fba.arrays import Float64
from fba_player._ui import theme
from fba_player._ui.panels.panel import Panel, choose_by_button, choose_name, heading, tooltip
from fba_player.scene._compare_timeline import Differences, Largest
from fba_player.scene.compare import CompareScene
from fba_player.session._session import Session

LISTED_PARAMETERS = 9
"""Number of parameters listed: those that differ most."""
MAX_CURVE_POINTS = 1500
"""Most points of a curve; longer ones are thinned to the largest value of each part."""
ARRANGEMENTS = {"side": "beside", "over": "over", "colour": "in colour", "wipe": "wipe"}
ROOT_TEXTS = {"own": "own places", "common": "one place"}
DEGREES = float(np.degrees(1e-5))


class DifferencesPanel(Panel):
    """The parameters that differ most, and the difference in one of them over time."""

    name, title, label = "differences", "Differences", "Differences"
    width, height, fitted, least = 390.0, 450.0, True, 260.0

    def __init__(self) -> None:
        self._second = 1
        self._known: tuple[Differences, list[Largest]] | None = None
        self._chosen: tuple[str, int] | None = None
        self._curve: tuple[object, Float64, Float64] | None = None

    def available(self, session: Session) -> bool:
        return isinstance(session.scene, CompareScene) and len(session.scene.scenes) > 1

    def draw(self, session: Session) -> None:
        scene: Any = session.scene
        self._arrangement(session, scene)
        self._second = min(self._second, len(scene.scenes) - 1)
        if len(scene.scenes) > 2:
            self._second = 1 + choose_name("##second", scene.names[1:], self._second - 1)
        scene.second = self._second
        differences = scene.differences(self._second)
        if self._known is None or self._known[0] is not differences:
            self._known = (differences, differences.largest(LISTED_PARAMETERS))
        largest = self._known[1]
        heading(f"{_short(scene.names[self._second])} minus {_short(scene.names[0])}", exact=True)
        if not largest:
            imgui.text_colored(theme.FAINT, _why_nothing_differs(scene, self._second, differences))
            return
        if self._chosen not in [(item.kind, item.number) for item in largest]:
            self._chosen = (largest[0].kind, largest[0].number)
        self._table(session, largest)
        chosen = next(item for item in largest if (item.kind, item.number) == self._chosen)
        self._plot(session, differences, chosen)

    def _arrangement(self, session: Session, scene: Any) -> None:
        arrangement = choose_by_button(ARRANGEMENTS, scene.arrangement)
        if arrangement is not None:
            scene.arrangement = arrangement
            session.viewpoint.reset()
        if scene.has_body:
            scene.root = choose_by_button(ROOT_TEXTS, scene.root) or scene.root

    def _table(self, session: Session, largest: list[Largest]) -> None:
        flags = imgui.TableFlags_.sizing_fixed_fit | imgui.TableFlags_.row_bg | imgui.TableFlags_.pad_outer_x
        if not imgui.begin_table("largest", 4, flags):
            return
        imgui.table_setup_column("parameter", imgui.TableColumnFlags_.width_stretch)
        for title in ("most", "rms", "unit"):
            imgui.table_setup_column(title)
        imgui.table_headers_row()
        for item in largest:
            imgui.table_next_row()
            imgui.table_next_column()
            chosen = (item.kind, item.number) == self._chosen
            whole_row = imgui.SelectableFlags_.span_all_columns
            if imgui.selectable(f"{item.number} {item.name}##{item.kind}", chosen, whole_row)[0]:
                self._chosen = (item.kind, item.number)
                session.transport.seek(item.time)
            tooltip(f"{item.kind.upper()} {item.number}: shows its course, and goes to where it differs most")
            factor, unit = _shown(item.unit)
            for text in (f"{item.most * factor:.{_digits(unit)}f}", f"{item.rms * factor:.1f}", unit):
                imgui.table_next_column()
                imgui.text_colored(theme.TEXT if chosen else theme.FAINT, text)
        imgui.end_table()

    def _plot(self, session: Session, differences: Differences, chosen: Largest) -> None:
        key = (differences, self._chosen)
        if self._curve is None or self._curve[0] != key:
            table = differences.faps if chosen.kind == "fap" else differences.baps
            values = table[:, chosen.number - 1].astype(np.float64) * _shown(chosen.unit)[0]
            self._curve = (key, *thin_curve(differences.times, values, MAX_CURVE_POINTS))
        _, times, values = self._curve
        imgui.dummy((0, 2))
        implot.push_style_color(implot.Col_.frame_bg, (0, 0, 0, 0))
        implot.push_style_color(implot.Col_.plot_bg, (0, 0, 0, 0.22))
        flags = implot.Flags_.no_legend | implot.Flags_.no_mouse_text | implot.Flags_.no_menus
        if implot.begin_plot("##course", imgui.ImVec2(-1, 150), flags):
            axis = implot.AxisFlags_
            implot.setup_axes("", "", axis.no_label, axis.no_label | axis.auto_fit)
            transport = session.transport
            implot.setup_axis_limits(implot.ImAxis_.x1, transport.start, transport.end, implot.Cond_.once)
            spec = implot.Spec()
            spec.line_color = imgui.ImVec4(*theme.ACCENT)
            spec.line_weight = 1.4
            implot.plot_line("difference", times, values, spec=spec)
            spec = implot.Spec()
            spec.line_color = imgui.ImVec4(*theme.TEXT)
            implot.plot_inf_lines("now", np.array([transport.time]), spec=spec)
            if implot.is_plot_hovered() and imgui.is_mouse_clicked(imgui.MouseButton_.left):
                transport.seek(implot.get_plot_mouse_pos().x)
            implot.end_plot()
        implot.pop_style_color(2)
        now = float(np.interp(session.transport.time, times, values))
        unit = _shown(chosen.unit)[1]
        imgui.text_colored(theme.FAINT, f"now {now:+.{_digits(unit)}f} {unit}")


def _why_nothing_differs(scene: Any, second: int, differences: Differences) -> str:
    """Return the text shown where nothing differs: the reason."""
    first, other = (scene.scenes[number].animation for number in (0, second))
    both_faces = first.face is not None and other.face is not None
    both_bodies = first.body is not None and other.body is not None
    if not (both_faces or both_bodies):
        return "one is a face, the other a body: nothing to compare"
    return "nothing differs" if len(differences.times) else "they have no time in common"


def thin_curve(times: Float64, values: Float64, most: int) -> tuple[Float64, Float64]:
    """Return a curve of at most `most` points: of each part, the value furthest from 0 at its time."""
    if len(times) <= most:
        return times, values
    borders = np.linspace(0, len(times), most + 1).astype(int).tolist()
    rows = [low + int(np.abs(values[low:high]).argmax()) for low, high in pairwise(borders)]
    return times[rows], values[rows]


def _shown(unit: str) -> tuple[float, str]:
    """Return the factor on amounts of a unit as they are shown, and the name of what they are then."""
    return (DEGREES, "deg") if unit == "1e-5 rad" else (1.0, unit)


def _digits(unit: str) -> int:
    return 1 if unit == "deg" else 0


def _short(name: str, most: int = 22) -> str:
    return name if len(name) <= most else name[: most - 1] + "…"
