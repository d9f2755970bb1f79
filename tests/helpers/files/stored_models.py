"""Small face models for the tests of their storage, by hand and by hypothesis."""

import io
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from hypothesis import strategies as st

from fba.face._expressions import Definitions
from fba.face._tables import HEAD, KINDS, FaceDefMesh, FaceDefTables, FaceDefTransform
from fba.face.feature_points import names, neutral_points
from fba.face.interpolation._node import Function, Link, Term
from fba.face.interpolation.table import InterpolationTable
from fba.face.model import PART_KINDS, DetailLevel, FaceModel, Material, Part, shape_key
from fba.parameters import faps, point_rows

UNITS_NEED = ("3.1", "3.2", "3.3", "3.4", "3.5", "3.6", "9.15", "2.2", "8.3", "8.4")
NAMES = [fap.name for fap in faps()[2:]]


@cache
def picture(kind: str = "PNG") -> bytes:
    """A real picture of 2 x 2 pixels."""
    from PIL import Image

    stream = io.BytesIO()
    Image.new("RGB", (2, 2), (200, 120, 90)).save(stream, kind)
    return stream.getvalue()


def face(**changes: Any) -> FaceModel:
    """A skin whose first 84 vertices are the feature points, two eyes and teeth; tables of each kind."""
    points = neutral_points()
    skin = points.astype(np.float32)
    triangles = np.array([[i, i + 1, i + 2] for i in range(len(skin) - 2)])
    colours = np.linspace(0, 1, len(skin) * 4, dtype=np.float32).reshape(-1, 4)
    parts = (
        Part(
            "skin", "skin", skin, triangles, colours=colours, material=Material("flesh", (0.7, 0.4, 0.3), 0.5)
        ),
        ball("left eye", "eye", points[point_rows()["3.5"]], Material("iris", texture=picture())),
        ball("right eye", "eye", points[point_rows()["3.6"]], Material("iris", texture=picture())),
        ball("upper teeth", "teeth", points[point_rows()["9.8"]], Material("enamel", roughness=0.2)),
    )
    lid = FaceDefMesh(
        "skin",
        [-1000, 0, 500, 1000],
        [50, 51],
        [[(1, 0, 0), (0.9, 0, 0), (1.5, 0, 4)], [(0.8, 0, 0), (0.7, 0, 0), (2, 0, 0)]],
    )
    straight = FaceDefMesh("skin", [-1, 0, 1], [3, 9, 4], [[(0, v, 0)] * 2 for v in (1, 0.5, 0.25)])
    pupil = FaceDefMesh("left eye", [0, 10], [1], [[(0.5, 0.5, 0)]])
    tables = (
        FaceDefTables(3, (straight,), ()),
        FaceDefTables(19, (lid,), ()),
        FaceDefTables(23, (), (FaceDefTransform("left eye", "rotation", (0, 1, 0), (0.031, 0, -0.012)),)),
        FaceDefTables(29, (pupil,), (FaceDefTransform("left eye", "scale", (1, 1, 0), (0.031, 0, -0.012)),)),
        FaceDefTables(49, (), (FaceDefTransform(HEAD, "rotation", (0, 1, 0), (0.0, -0.09, -0.05)),)),
    )
    settings: dict[str, Any] = {
        "parts": parts,
        "points": points,
        "bound": np.arange(84),
        "tables": tables,
        "fit": fit(),
        "name": "Näme",
        "lost": {65: "no ears", 66: "no ears"},
        "notes": {"licence": "MIT", "origin": "made for a test"},
        "wrinkles": True,
    }
    settings |= changes
    return FaceModel(**settings)


def face_with_level() -> FaceModel:
    """The same face with a level of detail, which is as fine as itself."""
    full = face()
    return replace(
        full, levels=(DetailLevel(full, np.arange(len(full.vertices)), 0.0, shape_key(full.parts)),)
    )


def ball(name: str, kind: str, centre: np.ndarray, material: Material) -> Part:
    """An octahedron with texture coordinates."""
    corners = np.array([(1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0), (0, 0, -1)])
    sides = [(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)]
    return Part(
        name, kind, centre + 0.012 * corners, np.array(sides), texcoords=corners[:, :2] / 2 + 0.5,
        material=material,
    )  # fmt: skip


def fit() -> InterpolationTable:
    """A FIT of two links with powers, an impulse and a denominator."""
    squared = Function(
        (Term(0.5, {"raise_l_i_eyebrow": 2}),), (Term(1.0), Term(2.0, {"raise_l_i_eyebrow": 2}))
    )
    smile = Function((Term(0.6, {"expression_intensity1": 1}, ("expression_select1", 1)),))
    return InterpolationTable(
        (
            Link(("raise_l_i_eyebrow",), {"raise_r_i_eyebrow": squared}),
            Link(("expression",), {"raise_l_cornerlip": smile}),
        )
    )


NUMBERS = st.floats(-2, 2, width=32)
TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)


@st.composite
def parts(draw: st.DrawFn) -> tuple[Part, ...]:
    """One to three meshes of random points, triangles and looks."""
    titles = draw(st.lists(TEXTS.filter(lambda t: t not in ("", HEAD)), min_size=1, max_size=3, unique=True))
    return tuple(draw(part(title)) for title in titles)


@st.composite
def part(draw: st.DrawFn, title: str) -> Part:
    count = draw(st.integers(3, 12))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    looks = draw(st.tuples(st.booleans(), st.booleans(), st.booleans()))
    return Part(
        name=title,
        kind=draw(st.sampled_from(PART_KINDS)),
        vertices=rng.normal(0, 0.1, (count, 3)),
        triangles=rng.integers(0, count, (draw(st.integers(1, 9)), 3)),
        normals=rng.normal(0, 1, (count, 3)) if looks[0] else None,
        texcoords=rng.uniform(-1, 2, (count, 2)) if looks[1] else None,
        colours=rng.uniform(0, 1, (count, 4)) if looks[2] else None,
        material=Material(
            draw(TEXTS),
            draw(st.tuples(*[st.floats(0, 1)] * 3)),
            draw(st.floats(0, 1)),
            draw(st.sampled_from([None, picture("PNG"), picture("JPEG")])) if looks[1] else None,
        ),
    )


@st.composite
def models(draw: st.DrawFn) -> FaceModel:
    """Faces of random parts and tables, with some feature points bound, some free and some missing."""
    meshes = draw(parts())
    places, bound = neutral_points().copy(), np.full(84, -1)
    joined = np.concatenate([mesh.vertices for mesh in meshes])
    for row, name in enumerate(names()):
        if name not in UNITS_NEED:
            fate = draw(st.sampled_from(["free", "missing", "bound"]))
            if fate == "missing":
                places[row] = np.nan
            elif fate == "bound":
                bound[row] = draw(st.integers(0, len(joined) - 1))
                places[row] = joined[bound[row]]
    numbers = draw(st.lists(st.integers(3, 68), max_size=4, unique=True))
    given = np.zeros((15 + 7, 68), dtype=np.float32)
    for _ in range(draw(st.integers(0, 5))):
        given[draw(st.integers(0, 21)), draw(st.integers(0, 67))] = draw(
            st.floats(width=32, allow_nan=False, allow_infinity=False)
        )
    return FaceModel(
        parts=meshes,
        points=places,
        bound=bound,
        tables=tuple(draw(table(number, meshes)) for number in numbers),
        fit=draw(st.sampled_from([None, fit()])),
        wrinkles=draw(st.booleans()),
        definitions=Definitions(given[:15], given[15:]),
        name=draw(TEXTS),
        lost=draw(st.dictionaries(st.integers(3, 68), TEXTS, max_size=3)),
        notes=draw(st.dictionaries(TEXTS, TEXTS, max_size=3)),
    )


@st.composite
def table(draw: st.DrawFn, number: int, meshes: tuple[Part, ...]) -> FaceDefTables:
    chosen = draw(st.lists(st.sampled_from(meshes), max_size=2, unique_by=lambda p: p.name))
    where = [HEAD, *(mesh.name for mesh in meshes)]
    vector = st.tuples(NUMBERS, NUMBERS, NUMBERS)
    transform = st.builds(FaceDefTransform, st.sampled_from(where), st.sampled_from(KINDS), vector, vector)
    return FaceDefTables(
        number,
        tuple(draw(face_def_mesh(mesh)) for mesh in chosen),
        tuple(draw(st.lists(transform, max_size=2))),
    )


@st.composite
def face_def_mesh(draw: st.DrawFn, mesh: Part) -> FaceDefMesh:
    borders = sorted({0, *draw(st.lists(st.integers(-(2**31), 2**31 - 1), min_size=1, max_size=4))} | {7})
    vertices = draw(st.lists(st.integers(0, len(mesh.vertices) - 1), max_size=5, unique=True))
    number = draw(
        st.sampled_from(
            [st.just(0.0), st.sampled_from([0.0, 1.0]), st.floats(-(2.0**-10), 2.0**-10, width=32)]
        )
    )
    shape = (len(vertices), len(borders) - 1, 3)
    size = int(np.prod(shape))
    values = draw(st.lists(number, min_size=size, max_size=size))
    return FaceDefMesh(
        mesh.name, np.array(borders), np.array(vertices, dtype=np.int64), np.reshape(values, shape)
    )


def assert_same(one: FaceModel, other: FaceModel) -> None:
    """Every value of two models is equal."""
    assert [vars_of(part) for part in one.parts] == [vars_of(part) for part in other.parts]
    assert np.array_equal(one.points, other.points, equal_nan=True)
    assert np.array_equal(one.bound, other.bound)
    assert [plain(each) for each in one.tables] == [plain(each) for each in other.tables]
    assert one.fit == other.fit
    assert np.array_equal(one.definitions.visemes, other.definitions.visemes)
    assert np.array_equal(one.definitions.expressions, other.definitions.expressions)
    for name in ("name", "lost", "notes", "wrinkles"):
        assert getattr(one, name) == getattr(other, name)


def vars_of(part: Part) -> dict[str, Any]:
    return {
        name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in vars(part).items()
    }


def plain(tables: FaceDefTables) -> Any:
    return (
        tables.fap,
        [(m.part, m.borders.tolist(), m.vertices.tolist(), m.displacements.tolist()) for m in tables.meshes],
        [(t.part, t.kind, t.amount, t.centre) for t in tables.transforms],
    )
