"""F3: the panel of the scene's switches."""

from __future__ import annotations

from imgui_bundle import imgui

from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP, faps
from fba_player._ui.panels.panel import Panel, choose_name, heading, tooltip
from fba_player.scene.scene import Scene
from fba_player.session._session import Session
from fba_player.view.switches import SWITCHES, Switch, Switches


class ViewPanel(Panel):
    """Each switch of the scene as a tick, a list of choices, or a list of FAPs."""

    name, title, label = "view", "View", "View"
    width, height, fitted, least = 300.0, 430.0, True, 190.0

    def draw(self, session: Session) -> None:
        scene = session.scene
        if isinstance(scene, Scene):
            heading("Shown as")
            for number, (name, text) in enumerate((("figure", "figure"), ("points", "points and bones"))):
                if number:
                    imgui.same_line()
                if imgui.radio_button(text, scene.view == name):
                    scene.view = name
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
