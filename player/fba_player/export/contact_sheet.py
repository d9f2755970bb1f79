"""Contact sheets: every FAP, viseme and expression of a face, or the main ones, each with its name."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np

from fba.animation import Animation
from fba.arrays import Float32, UInt8
from fba.face import FaceModel
from fba.parameters import EXPRESSIONS, FAP_COUNT, VISEMES, faps, point_rows
from fba.text_files import packaged_rows
from fba.tracks import FaceTrack
from fba_player.export._offscreen import Offscreen
from fba_player.export._sheet_layout import FAINT, PAPER, TEXT, check_tile, lay_out
from fba_player.scene.scene import Scene
from fba_player.view._camera import Camera, Subject
from fba_player.view._font import label_font, shortened

SHEETS = ("faps", "visemes", "expressions", "all", "review", "proof")
"""Names of the sheets."""
COLUMNS = {"faps": 11, "visemes": 7, "expressions": 3, "review": 8, "proof": 8}
TILE = {
    "faps": (160, 160),
    "visemes": (220, 220),
    "expressions": (360, 360),
    "review": (200, 200),
    "proof": (288, 360),
}
"""Columns, and width and height of a picture in pixels."""
THREE_QUARTER = 38.0
"""Degrees that the camera goes round for the second picture of a viseme or an expression."""
VIEWS = (
    ("front", "face", 0.0, 0.0), ("three-quarter", "face", THREE_QUARTER, 0.0),
    ("other side", "face", -THREE_QUARTER, 0.0), ("profile", "face", 90.0, 0.0), ("back", "face", 180.0, 0.0),
    ("from above", "face", 20.0, 35.0), ("from below", "face", 20.0, -25.0), ("near", "cheeks", 0.0, 0.0),
)  # fmt: skip
"""Views of a face at rest: label, see `close_up`, yaw and pitch of the camera."""
FULL_INTENSITY = 63
"""Intensity of the expressions: the largest that a stream can carry."""


@dataclass(frozen=True, eq=False)
class Tile:
    """One picture. label, note: the two lines below it. faps: float32 (68,). view: see `close_up`.

    yaw, pitch: of the camera, degrees.
    """

    label: str
    note: str
    faps: Float32
    view: str = "face"
    yaw: float = 0.0
    pitch: float = 0.0


def contact_sheet(
    what: str = "all", model: FaceModel | None = None, *, tile: tuple[int, int] | None = None
) -> UInt8:
    """Return a sheet of labelled pictures: uint8 (H, W, 3), sRGB.

    what: "faps", each of the 66 at a value and from a side that show it well; "visemes", the 14;
    "expressions", the 6 at full intensity; "all", one sheet below the other; "review", the rest pose, the
    main motions, visemes and expressions, which show whether a head was imported well; "proof", eight views,
    then expressions and visemes from two sides, to compare looks. model: the face, by
    default the built-in head. tile: width and height of one picture in pixels.

    Raises ValueError for another name, pictures below 16x16 or a sheet that would be too large, DisplayError
    where there is no OpenGL.
    """
    from PIL import Image

    if what not in SHEETS:
        raise ValueError(f"no contact sheet {what!r}; there are {', '.join(SHEETS)}")
    if tile is not None:
        check_tile(tile)
    kinds = SHEETS[:3] if what == "all" else (what,)
    scene = Scene(Animation(Fraction(25), np.arange(1), FaceTrack.empty(1)), model or FaceModel.default())
    sheets = [_sheet(scene, kind, tile or TILE[kind]) for kind in kinds]
    widest = max(sheet.width for sheet in sheets)
    joined = Image.new("RGB", (widest, sum(sheet.height for sheet in sheets)), PAPER)
    row = 0
    for sheet in sheets:
        joined.paste(sheet, ((widest - sheet.width) // 2, row))
        row += sheet.height
    return np.asarray(joined)


def tiles(kind: str, scene: Scene) -> list[Tile]:
    """Return the pictures of a sheet: one of `SHEETS` but "all"."""
    if kind == "faps":
        return list(_fap_tiles())
    if kind == "review":
        return [*_review_tiles(), *tiles("visemes", scene), *tiles("expressions", scene)]
    if kind == "proof":
        both = [*tiles("expressions", scene), *tiles("visemes", scene)]
        around = [replace(tile, yaw=yaw) for tile in both for yaw in (0.0, THREE_QUARTER)]
        return [*(Tile(label, "", _faps(""), view, yaw, pitch) for label, view, yaw, pitch in VIEWS), *around]
    definitions = scene.model.definitions
    if kind == "visemes":
        rows = zip(VISEMES[1:], definitions.visemes[1:], strict=True)
        return [Tile(name, f"viseme {n}", row, "cheeks") for n, (name, row) in enumerate(rows, start=1)]
    rows = zip(EXPRESSIONS[1:], definitions.expressions[1:], strict=True)
    note = f"expression {{}}, {FULL_INTENSITY}"
    return [Tile(name, note.format(n), row) for n, (name, row) in enumerate(rows, start=1)]


@cache
def _fap_tiles() -> tuple[Tile, ...]:
    tiles = []
    for row in packaged_rows(__package__, "contact_sheet.csv"):
        number = int(row["fap"])
        faps_shown = _faps(f"{row['with']} {number}={row['value']}")
        label = f"{number} {faps()[number - 1].name}"
        view = row["view"], float(row["yaw"]), float(row["pitch"])
        tiles.append(Tile(label, f"{int(row['value']):+d}", faps_shown, *view))
    return tuple(tiles)


@cache
def _review_tiles() -> tuple[Tile, ...]:
    return tuple(
        Tile(row["label"], "", _faps(row["faps"]), row["view"], float(row["yaw"]))
        for row in packaged_rows(__package__, "review_sheet.csv")
    )


def _faps(text: str) -> Float32:
    """Return FAPs, float32 (68,), read-only, of pairs NUMBER=VALUE; of two with one number, the last."""
    vector = np.zeros(FAP_COUNT, dtype=np.float32)
    for number, _, value in (pair.partition("=") for pair in text.split()):
        vector[int(number) - 1] = float(value)
    vector.flags.writeable = False
    return vector


def close_up(view: str, scene: Scene) -> Subject:
    """Return the subject of a close-up: "face", or a part of it such as "mouth".

    Parts are where the model's feature points are; without those points the subject is the face.
    """
    face = scene.face_subject
    unit = scene.model.fapu
    eyes, mouth, nose = unit.ES * 1024, unit.MW * 1024, unit.ENS * 1024
    close_ups: dict[str, tuple[tuple[str, ...], tuple[float, float, float], float, float]] = {
        "eyes": (("3.5", "3.6"), (0.0, 0.0, 0.0), 0.62 * eyes, 0.95 * eyes),
        "left eye": (("3.5",), (0.0, 0.0, 0.0), 0.42 * eyes, 0.42 * eyes),
        "right eye": (("3.6",), (0.0, 0.0, 0.0), 0.42 * eyes, 0.42 * eyes),
        "left ear": (("10.1", "10.5"), (0.0, 0.0, 0.0), 1.1 * nose, 1.1 * nose),
        "right ear": (("10.2", "10.6"), (0.0, 0.0, 0.0), 1.1 * nose, 1.1 * nose),
        "cheeks": (("9.3", "3.5", "3.6"), (0.0, -0.45 * nose, 0.0), 1.05 * eyes, 1.05 * eyes),
        "brows": (("3.5", "3.6"), (0.0, 0.35 * eyes, 0.0), 0.80 * eyes, 1.15 * eyes),
        "nose": (("9.3", "9.15"), (0.0, 0.12 * nose, 0.0), 0.75 * nose, 0.80 * nose),
        "mouth": (("8.1", "8.2", "8.3", "8.4"), (0.0, -0.12 * mouth, 0.0), 0.75 * mouth, 0.85 * mouth),
        "jaw": (("8.3", "8.4", "2.1"), (0.0, 0.0, 0.0), 1.45 * mouth, 1.5 * mouth),
    }
    if view not in close_ups:
        x, y, z = face.centre
        return Subject((x, y + 0.05 * face.half_height, z), 0.86 * face.half_height, 0.86 * face.half_width)
    names, offset, half_height, half_width = close_ups[view]
    points = scene.model.points
    middle = np.mean([points[point_rows()[name]] for name in names], axis=0) + offset
    if not np.isfinite(middle).all():
        return face
    x, y, z = middle.tolist()
    return Subject((x, y, z), half_height, half_width)


def _sheet(scene: Scene, kind: str, size: tuple[int, int]) -> Any:
    """Return a sheet as a `PIL.Image`."""
    from PIL import Image, ImageDraw

    shown = tiles(kind, scene)
    width, height = size
    letters = max(min(width // 12, 16), 7)
    line = round(letters * 1.35)
    layout = lay_out(len(shown), (width, height + 2 * line + 4), COLUMNS[kind])
    sheet = Image.new("RGB", layout.size, PAPER)
    draw = ImageDraw.Draw(sheet)
    font, small = label_font(letters), label_font(letters * 0.9)
    with Offscreen(scene, size) as view:
        for tile, (x, y) in zip(shown, layout.corners, strict=True):
            subject = close_up(tile.view, scene)
            view.camera = Camera(yaw=tile.yaw, pitch=tile.pitch).fit(subject, width / height)
            sheet.paste(Image.fromarray(view.still(tile.faps)[..., :3]), (x, y))
            draw.text((x + 2, y + height + 2), shortened(draw, tile.label, font, width), font=font, fill=TEXT)
            draw.text((x + 2, y + height + 2 + line), tile.note, font=small, fill=FAINT)
    return sheet
