"""F1, F3 and F4: the panels of help, of the switches of the scene, and of the camera."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP, faps
from fba_player._ui import theme
from fba_player._ui.panels.panel import Panel, choose_by_button, choose_name, heading, tooltip, wrapped
from fba_player.scene.scene import Scene
from fba_player.session._actions import FOLLOW_TEXTS, act
from fba_player.session._keys import key_of, keys, mouse
from fba_player.session._session import Session
from fba_player.view._camera import DISTANCES, PITCH_LIMIT, PRESETS
from fba_player.view.switches import SWITCHES, Switch, Switches

LOOK_TEXTS = {"figure": "figure", "points": "points and bones"}


class ViewPanel(Panel):
    """Each switch of the scene as a tick, a list of choices, or a list of FAPs."""

    name, title, label = "view", "View", "View"
    width, height, fitted, least = 300.0, 620.0, True, 190.0

    def draw(self, session: Session) -> None:
        scene = session.scene
        if isinstance(scene, Scene):
            heading("Shown as")
            scene.view = choose_by_button(LOOK_TEXTS, scene.view) or scene.view
        heading("Switches")
        switches = scene.switches
        for switch in SWITCHES.values():
            if switch.kind == "flag":
                changed, on = imgui.checkbox(switch.label, bool(switches[switch.name]))
                if changed:
                    scene.show(switch.name, on)
            elif switch.kind == "choice":
                now = switch.choices.index(str(switches[switch.name]))
                chosen = choose_name(switch.label, switch.choices, now, 132)
                scene.show(switch.name, switch.choices[chosen])
            else:
                _fap(switch, switches)
            tooltip(switch.description, session.switch_key(switch))
        if switches.changed and imgui.button("Reset switches", (-1, 0)):
            for name in switches.changed:
                scene.show(name, SWITCHES[name].default)


def _fap(switch: Switch, switches: Switches) -> None:
    imgui.set_next_item_width(132)
    if imgui.begin_combo(switch.label, switches.text(switch.name)):
        if imgui.selectable("off", switches[switch.name] is None)[0]:
            switches.show(switch.name, None)
        for number in range(FIRST_LOW_LEVEL_FAP, FAP_COUNT + 1):
            chosen = switches[switch.name] == number
            if imgui.selectable(f"{number} {faps()[number - 1].name}", chosen)[0]:
                switches.show(switch.name, number)
        imgui.end_combo()


class CameraPanel(Panel):
    """Presets, angles, distance, and whether the camera follows the figure."""

    name, title, label = "camera", "Camera", "Camera"
    width, height, fitted, least = 300.0, 470.0, True, 180.0

    def draw(self, session: Session) -> None:
        viewpoint = session.viewpoint
        wide = (imgui.get_content_region_avail().x - 9) / 2
        for number, name in enumerate(PRESETS):
            if number % 2:
                imgui.same_line()
            if imgui.button(f"{name.capitalize()}##{name}", (wide, 0)):
                act(session, f"camera {name}")
            tooltip(f"view: {name}", key_of(f"camera {name}"))
        if imgui.button("Reset", (-1, 0)):
            act(session, "reset_view")
        tooltip("reset the view", key_of("reset_view"))
        heading("By hand")
        camera = viewpoint.camera
        imgui.push_item_width(-86)
        turned, yaw = imgui.slider_float("turn", camera.yaw, -180, 180, "%.0f deg")
        tilted, pitch = imgui.slider_float("tilt", camera.pitch, -PITCH_LIMIT, PITCH_LIMIT, "%.0f deg")
        low, high = DISTANCES[0], min(DISTANCES[1], 20.0)
        moved, distance = imgui.slider_float(
            "distance", camera.distance, low, high, "%.2f m", imgui.SliderFlags_.logarithmic
        )
        opened, angle = imgui.slider_float("angle", camera.field_of_view, 8, 70, "%.0f deg")
        imgui.pop_item_width()
        if turned or tilted:
            viewpoint.camera = replace(camera, yaw=yaw, pitch=min(max(pitch, -PITCH_LIMIT), PITCH_LIMIT))
        if moved:
            viewpoint.camera = replace(camera, distance=min(max(distance, low), DISTANCES[1]))
        if opened:
            viewpoint.camera = replace(camera, field_of_view=min(max(angle, 8.0), 70.0))
        heading("Moves along")
        order = list(FOLLOW_TEXTS)
        now = order.index(viewpoint.follow)
        chosen = choose_name("follows", list(FOLLOW_TEXTS.values()), now, -86)
        if chosen != now:
            act(session, f"follow {order[chosen] or 'itself'}")
        tooltip("by itself: the head in views of the face, else a figure that walks away", key_of("follow"))
        turning = session.scene.orbit is not None
        if imgui.checkbox("turns around the figure", turning)[0]:
            act(session, "orbit")
        tooltip("turn slowly around the figure", key_of("orbit"))
        if imgui.button("Copy the command", (-1, 0)):
            act(session, "copy_command")
        tooltip("the command that draws this view", key_of("copy_command"))
        imgui.text_colored(theme.FAINT, "x {:.2f}  y {:.2f}  z {:.2f} m".format(*camera.target))


MIN_COLUMN_WIDTH = 296.0
"""Least width of a column in points."""
KEY_WIDTH = 124.0
"""Largest width of the keys in a column, in points."""
COLUMNS = {
    2: (("Play", "Save", "Window"), ("View", "Switches", "Mouse")),
    3: (("Play",), ("View", "Switches", "Save"), ("Window", "Mouse")),
    4: (("Play",), ("View", "Switches"), ("Window", "Save"), ("Mouse",)),
}
"""Groups in each column, by the number of columns."""


class HelpPanel(Panel):
    """The keys of actions and switches, and the mouse; in as many columns as fit."""

    name, title, label = "help", "Keys and mouse", "Help"
    side = "middle"
    width, height, fitted = 1240.0, 520.0, True

    def draw(self, session: Session) -> None:
        groups = _groups(session)
        columns = min(int(imgui.get_content_region_avail().x // MIN_COLUMN_WIDTH), 4)
        imgui.push_style_var(imgui.StyleVar_.cell_padding, (6, 1.5))
        if columns > 1 and imgui.begin_table("columns", columns):
            imgui.table_next_row()
            for names in COLUMNS[columns]:
                imgui.table_next_column()
                for name in names:
                    _group(name, groups.get(name, []))
            imgui.end_table()
        elif columns <= 1:
            for name, rows in groups.items():
                _group(name, rows)
        imgui.pop_style_var()


def _groups(session: Session) -> dict[str, list[tuple[str, str]]]:
    """Return (keys, what they do) by name of the group."""
    groups: dict[str, list[tuple[str, str]]] = {}
    for row in keys():
        groups.setdefault(row.group, []).append((row.shown, row.does))
    groups["Switches"] = session.switch_keys()
    groups["Mouse"] = list(mouse())
    return groups


def _group(name: str, rows: list[tuple[str, str]]) -> None:
    if not rows:
        return
    heading(name)
    imgui.begin_table(name, 2, imgui.TableFlags_.sizing_fixed_fit)
    wide = min(max(imgui.calc_text_size(key).x for key, _ in rows), KEY_WIDTH)
    imgui.table_setup_column("key", imgui.TableColumnFlags_.width_fixed, wide)
    imgui.table_setup_column("does", imgui.TableColumnFlags_.width_stretch)
    for key, does in rows:
        imgui.table_next_row()
        imgui.table_next_column()
        wrapped(key)
        imgui.table_next_column()
        wrapped(does, theme.FAINT)
    imgui.end_table()
