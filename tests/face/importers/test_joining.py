"""Pieces joined to one part look as they did: textures become one picture, colours those of vertices."""

import io

import numpy as np
import pytest
from PIL import Image

from fba.face.importers.assembly._joining import MAX_PIXELS, join_pieces, make_atlas
from fba.face.importers.assembly._polygon_parts import Piece
from fba.face.model import Material, Part


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
    assert coords is not None
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
    assert joined.colours is not None
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
    assert atlas is not None
    with Image.open(io.BytesIO(atlas.texture)) as image:
        assert max(image.size) <= MAX_PIXELS
    same(shown(join_pieces(pieces, "skin", "skin")), [BLUE] * 4 + [RED] * 4)
    endless = sheet("brick", picture(GREEN), [(0, 0), (50, 0), (0, 50), (50, 50)])
    assert make_atlas([pieces[0].part, endless.part]) is None
