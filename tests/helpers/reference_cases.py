"""The pictures that have references: what they show, read from a table, and drawn.

A row of references/cases.csv: name; content: face, or body (with its face); faps, visemes, expressions, baps:
as `fba render` takes them, several apart by spaces; camera, view: as there, and cameras `NEAR`; switches: as
`--show` takes them.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import TracebackType

import numpy as np
import numpy.typing as npt

from fba.animation import Animation
from fba.body import BodyModel
from fba.cli.pose_options import Pose, still_animation
from fba.face.model import FaceModel
from fba.parameters import BAP_COUNT, bap_numbers, point_rows
from fba.player import Camera, Offscreen, Scene
from fba.tracks import BodyTrack
from fba_player._figure.face import FaceFigure, build_figure
from fba_player._figure.person import Person, build_person
from fba_player.view.switches import Quality, parse_switch

FOLDER = Path(__file__).parents[1] / "player" / "gl" / "references"
NEAR = {"eyes": "3.5", "mouth": "2.2"}
"""Feature points that cameras of these names look at from nearby."""
SIZES = {"face": (160, 120), "body": (120, 160)}


@dataclass(frozen=True)
class Case:
    """One row."""

    name: str
    content: str
    faps: tuple[str, ...]
    visemes: tuple[str, ...]
    expressions: tuple[str, ...]
    baps: tuple[str, ...]
    camera: str
    view: str
    switches: tuple[str, ...]

    @property
    def path(self) -> Path:
        """Where its reference lies."""
        return FOLDER / f"{self.name}.png"

    @property
    def size(self) -> tuple[int, int]:
        """Of its picture, pixels."""
        return SIZES[self.content]

    def animation(self) -> Animation:
        """One frame."""
        rest = () if self.visemes or self.expressions else ("open_jaw=0",)
        found = still_animation(Pose(self.faps or rest, self.visemes, self.expressions))
        if self.content == "face":
            return found
        values = np.zeros((1, BAP_COUNT), dtype=np.int32)
        for word in self.baps:
            name, _, value = word.partition("=")
            values[0, bap_numbers()[name] - 1] = int(value)
        return Animation(found.rate, found.index, found.face, BodyTrack(values, values != 0), self.name)

    def scene(self) -> Scene:
        """The figure is made once for all."""
        scene = Scene(self.animation(), _figure().model, view=self.view or "figure")
        scene._figure = _figure()
        if self.content == "body":
            scene._person = _person()
        for text in self.switches:
            scene.show(*parse_switch(text))
        return scene


@cache
def _figure() -> FaceFigure:
    return build_figure(FaceModel.default())


@cache
def _person() -> Person:
    return build_person(BodyModel.default(), _figure())


@cache
def cases() -> dict[str, Case]:
    """All rows by name."""
    text = (FOLDER / "cases.csv").read_text(encoding="utf-8")
    found = {}
    for row in csv.DictReader(text.splitlines()):
        words = {
            key: tuple((row[key] or "").split())
            for key in ("faps", "visemes", "expressions", "baps", "switches")
        }
        found[row["name"]] = Case(
            name=row["name"], content=row["content"], camera=row["camera"], view=row["view"] or "", **words
        )  # fmt: skip
    return found


class Drawer:
    """Draws cases, with one `Offscreen` for each size. A context manager."""

    def __init__(self) -> None:
        self._open: dict[tuple[int, int], Offscreen] = {}

    def __call__(
        self, case: Case, scene: Scene | None = None, *, moved: tuple[float, float] = (0.0, 0.0)
    ) -> npt.NDArray[np.uint8]:
        """The picture: uint8 (H, W, 4). scene: instead of the case's own. moved: to the left, down."""
        scene = scene or case.scene()
        if case.size not in self._open:
            self._open[case.size] = Offscreen(scene, case.size, samples=Quality.FAST.samples)
        offscreen = self._open[case.size]
        offscreen.scene = scene
        if case.camera in NEAR:
            _, y, z = scene.model.points[point_rows()[NEAR[case.camera]]]
            offscreen.camera = Camera((0.0, float(y), float(z)), yaw=10.0, distance=0.25)
        else:
            offscreen.camera = scene.camera(case.camera or None, case.size[0] / case.size[1])
        offscreen.camera = offscreen.camera.pan(moved[0] / case.size[1], moved[1] / case.size[1])
        return offscreen.frame(0.0)

    def __enter__(self) -> Drawer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for offscreen in self._open.values():
            offscreen.close()
