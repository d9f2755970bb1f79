"""F4: the camera panel."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from fba_player._ui import theme
from fba_player._ui.panels.panel import Panel, heading, tooltip
from fba_player.session._actions import act
from fba_player.session._keys import key_of
from fba_player.session._session import Session
from fba_player.view.camera import DISTANCES, PITCH_LIMIT, PRESETS


class CameraPanel(Panel):
    """Presets, angles, distance, and whether the camera follows the figure."""

    name, title, label = "camera", "Camera", "Camera"
    width, height, fitted, least = 300.0, 320.0, True, 180.0

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
        if any(session.scene.travel(session.transport.time)) or not viewpoint.follow:
            changed, _ = imgui.checkbox("follow the performance", viewpoint.follow)
            if changed:
                act(session, "follow")
        imgui.text_colored(theme.FAINT, "x {:.2f}  y {:.2f}  z {:.2f} m".format(*camera.target))
