"""Pieces joined to one part look as they did: textures become one picture. Skin slides over the teeth."""

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from fba.face.authoring import author
from fba.face.checks._fap_checks import check_posed
from fba.face.checks._posing import Poser
from fba.face.importers.assembly._joining import MAX_PIXELS, join_pieces, make_atlas
from fba.face.importers.assembly._polygon_parts import Piece
from fba.face.importers.assembly._teeth_clearance import STRETCH, clear_teeth
from fba.face.model import FaceModel, Material, Part
from small_head import small_head


def picture(colour: tuple[int, ...], size: tuple[int, int] = (64, 32), other: tuple[int, ...] = ()) -> bytes:
    """A PNG of one colour, its right half of another one."""
    image = Image.new("RGBA" if len(colour) == 4 else "RGB", size, colour)
    if other:
        image.paste(other, (size[0] // 2, 0, *size))
    stream = io.BytesIO()
    image.save(stream, "PNG")
    return stream.getvalue()


def sheet(name: str, texture: bytes | None, texcoords: list[tuple[float, float]] | None) -> Piece:
    vertices = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)], dtype=np.float32)
    coords = None if texcoords is None else np.array(texcoords, dtype=np.float32)
    material = Material(name, (1.0, 1.0, 1.0), texture=texture)
    part = Part(name, "skin", vertices, np.array([(0, 1, 2), (1, 3, 2)]), texcoords=coords, material=material)
    return Piece(part, name)


def shown(piece: Piece) -> list[tuple[int, ...]]:
    """The colour of the texture at each vertex, as a renderer that repeats textures shows it."""
    texture, coords = piece.part.material.texture, piece.part.texcoords
    assert texture is not None
    with Image.open(io.BytesIO(texture)) as image:
        pixels = np.asarray(image)
    columns = np.floor(coords[:, 0] * pixels.shape[1]).astype(int) % pixels.shape[1]
    rows = np.floor(coords[:, 1] * pixels.shape[0]).astype(int) % pixels.shape[0]
    return [tuple(map(int, colour)) for colour in pixels[rows, columns]]


RED, GREEN, BLUE = (200, 30, 20), (20, 180, 40), (10, 30, 190)
SQUARE = [(0.1, 0.1), (0.9, 0.1), (0.1, 0.9), (0.9, 0.9)]


def same(found: list[tuple[int, ...]], wanted: list[tuple[int, ...]]) -> None:
    np.testing.assert_allclose([colour[:3] for colour in found], wanted, atol=3)


def test_each_piece_keeps_its_own_texture() -> None:
    """A face whose body has more vertices was as brown as one pixel of the body's texture."""
    face = sheet("face", picture(RED, other=GREEN), SQUARE)
    body = sheet("body", picture(BLUE, (16, 128)), SQUARE)
    joined = join_pieces([body, face], "skin", "skin")
    same(shown(joined), [BLUE] * 4 + [RED, GREEN, RED, GREEN])


def test_a_piece_without_texture_keeps_its_colour() -> None:
    plain = sheet("neck", None, None)
    joined = join_pieces([sheet("face", picture(RED), SQUARE), plain], "skin", "skin")
    same(shown(joined), [RED] * 4 + [(255, 255, 255)] * 4)


def test_textures_that_repeat_show_the_same_after_joining() -> None:
    beyond = [(-0.4, 0.1), (0.4, 0.1), (1.4, 1.3), (2.4, -0.2)]
    face = sheet("face", picture(RED, other=GREEN), beyond)
    joined = join_pieces([face, sheet("body", picture(BLUE), SQUARE)], "skin", "skin")
    same(shown(joined), [*shown(face), *[BLUE] * 4])


def test_holes_of_a_texture_stay() -> None:
    joined = join_pieces(
        [sheet("face", picture((*RED, 0)), SQUARE), sheet("body", picture(BLUE), SQUARE)], "skin", "skin"
    )
    assert [colour[3] for colour in shown(joined)] == [0] * 4 + [255] * 4


def test_colours_of_vertices_are_not_multiplied_by_the_material_again() -> None:
    part = sheet("face", None, None).part
    dim = Material("dim", (0.5, 0.5, 0.5), 0.7)
    own = Part(
        "a",
        "skin",
        part.vertices,
        part.triangles,
        colours=np.full((4, 4), 0.25, np.float32),
        material=dim,
    )
    other = Part("b", "skin", part.vertices, part.triangles, material=dim)
    joined = join_pieces([Piece(own), Piece(other)], "skin", "skin").part
    np.testing.assert_allclose(joined.colours[:4], 0.25)
    np.testing.assert_allclose(joined.colours[4:], [[0.5, 0.5, 0.5, 0.3]] * 4, rtol=1e-6)


@pytest.mark.parametrize("texture", [b"no picture", picture(RED)[:60]])
def test_damaged_pictures_leave_that_of_the_largest_piece(texture: bytes) -> None:
    body = sheet("body", picture(BLUE), SQUARE)
    joined = join_pieces([body, sheet("face", texture, SQUARE)], "skin", "skin")
    same(shown(joined)[:4], [BLUE] * 4)


def test_pictures_become_no_larger_than_one_that_cards_can_hold() -> None:
    wide = [(0.0, 0.0), (3.9, 0.0), (0.0, 1.0), (3.9, 1.0)]
    pieces = [sheet(str(k), picture(RED if k else BLUE, (1024, 8)), wide) for k in range(2)]
    atlas = make_atlas([piece.part for piece in pieces])
    with Image.open(io.BytesIO(atlas.texture)) as image:
        assert max(image.size) <= MAX_PIXELS
    same(shown(join_pieces(pieces, "skin", "skin")), [BLUE] * 4 + [RED] * 4)
    endless = sheet("brick", picture(GREEN), [(0, 0), (50, 0), (0, 50), (50, 50)])
    assert make_atlas([pieces[0].part, endless.part]) is None


def rows(shift: float) -> Part:
    """A half round row of teeth, 4.6 cm wide and 3 cm high, as far behind the lips as a shift."""
    turn = np.linspace(0, np.pi, 25)
    line = np.stack([0.023 * np.cos(turn), np.zeros(25), 0.035 * np.sin(turn)], axis=1)
    low, high = line + np.array((0, -0.085, shift)), line + np.array((0, -0.055, shift))
    k = np.arange(24)
    triangles = np.concatenate([np.c_[k, k + 25, k + 1], np.c_[k + 1, k + 25, k + 26]])
    return Part("upper teeth", "teeth", np.concatenate([low, high]), triangles)


def depth_of_row(x: np.ndarray, shift: float) -> np.ndarray:
    return 0.035 * np.sqrt(np.maximum(1 - (x / 0.023) ** 2, 0)) + shift


@pytest.fixture(scope="module")
def heads() -> tuple[FaceModel, FaceModel, float]:
    """A head before and after, and where its teeth are: 1 mm behind the skin in front of them."""
    head = small_head(cell=0.005)
    parts = tuple(part for part in head.parts if part.kind not in ("teeth", "tongue"))
    skin = head.part("skin").vertices
    near = (np.abs(skin[:, 0]) < 0.0225) & (skin[:, 1] > -0.085) & (skin[:, 1] < -0.055)
    shift = float((skin[near, 2] - depth_of_row(skin[near, 0], 0.0)).min()) - 0.001
    bound = np.where(head.bound < sum(len(part.vertices) for part in parts), head.bound, -1)
    base = author((*parts, rows(shift)), head.points, bound=bound)
    return base, clear_teeth(base), shift


def through_the_teeth(model: FaceModel, shift: float, value: float) -> float:
    """Metres by which skin is behind the front of the teeth, at the vertices and between them."""
    moved = Poser(model).pose(dict.fromkeys(STRETCH, value))
    skin = moved[model.starts["skin"] :][: len(model.part("skin").vertices)]
    triangles = model.part("skin").triangles
    points = np.concatenate([skin, skin[triangles].mean(axis=1)])
    beside = (points[:, 1] > -0.083) & (points[:, 1] < -0.057) & (np.abs(points[:, 0]) < 0.0225)
    return float((depth_of_row(points[beside, 0], shift) - points[beside, 2]).max())


def test_skin_stays_in_front_of_the_teeth(heads: tuple[FaceModel, FaceModel, float]) -> None:
    base, cleared, shift = heads
    assert through_the_teeth(base, shift, 0.0) < -0.0005
    for value in (-140.0, -250.0):
        assert through_the_teeth(base, shift, value) > 0.0015
        assert through_the_teeth(cleared, shift, value) < 0.0006, value


def test_corners_move_as_far_sideways_as_before(heads: tuple[FaceModel, FaceModel, float]) -> None:
    base, cleared, _ = heads
    for value in (-300.0, -100.0, -10.0, 200.0):
        before, after = (Poser(model).shift(dict.fromkeys(STRETCH, value)) for model in (base, cleared))
        np.testing.assert_allclose(after[:, :2], before[:, :2], atol=2e-7)
        if value > -20:
            np.testing.assert_allclose(after, before, atol=2e-7)
        else:
            assert (after[:, 2] > before[:, 2] - 1e-7).all()


def test_both_sides_come_forward_alike(heads: tuple[FaceModel, FaceModel, float]) -> None:
    _, cleared, _ = heads
    poser = Poser(cleared)
    left = poser.shift({6: -200, 53: -200})[poser.vertex("2.4")]
    right = poser.shift({7: -200, 54: -200})[poser.vertex("2.5")]
    np.testing.assert_allclose(left * (-1, 1, 1), right, atol=1.5e-3)
    assert left[2] > 0.002


def test_no_triangle_turns_over(heads: tuple[FaceModel, FaceModel, float]) -> None:
    base, cleared, _ = heads
    found = [
        sum(finding.severity == "error" for finding in check_posed(Poser(model), STRETCH))
        for model in (base, cleared)
    ]
    assert found[1] <= found[0]


def test_heads_without_teeth_stay_as_they_are(heads: tuple[FaceModel, FaceModel, float]) -> None:
    base, _, _ = heads
    parts = tuple(replace(part, kind="mouth") if part.kind == "teeth" else part for part in base.parts)
    without = replace(base, parts=parts)
    assert clear_teeth(without) is without
