"""Keys and mouse -> transport and camera; knows no window and no OpenGL.

Places are in pixels from the upper left corner of the picture.
"""

from __future__ import annotations

from player.camera import Camera
from player.scene import Scene
from player.transport import Transport

BAR_HEIGHT = 52
"""Pixels at the bottom that belong to the timeline, at a display scale of 1."""
BAR_MARGIN = 16
ORBIT_SPEED = 0.35
"""Degrees a pixel."""
ZOOM_STEP = 0.9
PRESET_KEYS = {"1": "front", "2": "three-quarter", "3": "profile", "4": "body"}

HELP = (
    ("space", "play, pause"),
    ("left, right", "one frame back, on"),
    ("home, end", "first, last frame"),
    ("timeline", "click or drag to seek"),
    ("+, -", "faster, slower (0.1x to 4x)"),
    ("0", "normal speed"),
    ("L", "loop on, off"),
    ("drag", "turn around the subject"),
    ("right drag", "move the view (middle drag too)"),
    ("wheel", "nearer, further"),
    ("1 2 3 4", "front, three-quarter, profile, body"),
    ("R", "reset the view"),
    ("P", "feature points and bones, or a figure"),
    ("F1", "this help"),
    ("Esc, Q", "close"),
)
"""What the keys and the mouse do, for the help."""


class Controls:
    """What the user can do. size: of the picture in pixels; scale: pixels a display point."""

    def __init__(
        self, scene: Scene, transport: Transport, size: tuple[int, int], camera: Camera | None = None
    ) -> None:
        self.scene = scene
        self.transport = transport
        self.size = size
        self.scale = 1.0
        self.help = False
        self.closing = False
        self._first = camera
        self.camera = camera if camera is not None else scene.camera(None, self.aspect)
        self._held: str | None = None
        self._last = (0.0, 0.0)

    @property
    def aspect(self) -> float:
        """Width / height of the picture."""
        return self.size[0] / max(self.size[1], 1)

    def key(self, name: str) -> bool:
        """A key was pressed; names as in `HELP`, lower case. Returns whether it means something."""
        transport = self.transport
        actions = {
            "space": transport.toggle,
            "left": lambda: transport.step(-1),
            "right": lambda: transport.step(1),
            "home": transport.first,
            "end": transport.last,
            "+": transport.faster,
            "-": transport.slower,
            "0": lambda: transport.set_speed(1.0),
            "l": transport.toggle_loop,
            "r": self.reset_view,
            "p": self.toggle_points,
            "f1": self._toggle_help,
            "escape": self._close,
            "q": self._close,
        }
        if name in PRESET_KEYS:
            self.camera = self.scene.camera(PRESET_KEYS[name], self.aspect)
            return True
        if name not in actions:
            return False
        actions[name]()
        return True

    def press(self, button: str, x: float, y: float) -> None:
        """A mouse button ("left", "right", "middle") goes down."""
        self._last = (x, y)
        if button == "left" and y >= self.size[1] - BAR_HEIGHT * self.scale:
            self._held = "timeline"
            self._seek(x)
        elif button in ("left", "right", "middle"):
            self._held = "orbit" if button == "left" else "pan"

    def move(self, x: float, y: float) -> None:
        """The mouse moves."""
        right, down = x - self._last[0], y - self._last[1]
        self._last = (x, y)
        if self._held == "timeline":
            self._seek(x)
        elif self._held == "orbit":
            turn = ORBIT_SPEED / self.scale
            self.camera = self.camera.orbit(-right * turn, down * turn)
        elif self._held == "pan":
            height = max(self.size[1], 1)
            self.camera = self.camera.pan(-right / height, down / height)

    def release(self) -> None:
        """The mouse button goes up."""
        self._held = None

    def scroll(self, steps: float) -> None:
        """The wheel turns; away from the user is positive and comes nearer."""
        self.camera = self.camera.zoom(ZOOM_STEP ** max(min(steps, 10.0), -10.0))

    def reset_view(self) -> None:
        """The camera of the beginning."""
        self.camera = self._first if self._first is not None else self.scene.camera(None, self.aspect)

    def toggle_points(self) -> None:
        """Feature points and bones instead of the figure, or back."""
        self.scene.view = "figure" if self.scene.view == "points" else "points"

    def bar(self) -> tuple[float, float]:
        """Where the timeline begins and ends, x in pixels."""
        margin = BAR_MARGIN * self.scale
        return margin, max(self.size[0] - margin, margin + 1)

    def _seek(self, x: float) -> None:
        low, high = self.bar()
        self.transport.seek_share((x - low) / (high - low))

    def _toggle_help(self) -> None:
        self.help = not self.help

    def _close(self) -> None:
        self.closing = True
