"""Simplified faces: what they carry, how they move, and levels of detail in files."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.figures.simplification import distances, place
from fba.compiled import is_compiled
from fba.errors import ModelError
from fba.face import Deformer, FaceModel
from fba.face.checks import check_faps, check_neutral
from fba.face.model import DetailLevel, shape_key
from fba.face.simplification import FaceSimplification, level_sizes, simplify_face
from fba.face.simplification._tables import find_lines
from fba.mesh import read_obj
from fba.mesh.simplify import simplify
from fba.parameters import FAP_COUNT
from small_face import small_face

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not is_compiled(), reason="too slow without numba"),
]
SOURCE_STAGES = (2141, 1929, 1307, 680)


@pytest.fixture(scope="module")
def made() -> FaceSimplification:
    model = replace(FaceModel.default(), levels=())
    return simplify_face(model, [len(model.triangles) // 3, *SOURCE_STAGES])


@pytest.fixture(scope="module")
def tenth(made: FaceSimplification) -> DetailLevel:
    return made.build(made.mesh.level(3641))


def test_the_stages_of_the_source_are_reached(made: FaceSimplification) -> None:
    assert [len(made.mesh.level(faces).triangles) for faces in SOURCE_STAGES] == list(SOURCE_STAGES)


def test_parts_points_and_looks_are_carried(made: FaceSimplification, tenth: DetailLevel) -> None:
    full, small = made.model, tenth.model
    assert len(small.triangles) <= 3641
    assert [part.name for part in small.parts] == [part.name for part in full.parts]
    np.testing.assert_array_equal(small.points, full.points)
    bound = full.bound >= 0
    np.testing.assert_array_equal(small.vertices[small.bound[bound]], full.vertices[full.bound[bound]])
    for before, after in zip(full.parts, small.parts, strict=True):
        assert after.material == before.material
        assert (after.texcoords is None) == (before.texcoords is None)
        assert np.linalg.norm(after.normals, axis=1) == pytest.approx(1, abs=1e-3)
    assert [table.fap for table in small.tables] == [table.fap for table in full.tables]
    assert sum(len(mesh.vertices) for table in small.tables for mesh in table.meshes) < 12_000


def test_feature_points_move_as_on_the_full_face(made: FaceSimplification, tenth: DetailLevel) -> None:
    values = np.random.default_rng(3).uniform(-150, 150, (4, FAP_COUNT)).astype(np.float32)
    before = Deformer(made.model).feature_points(values)
    after = Deformer(tenth.model).feature_points(values)
    off = np.nanmax(np.linalg.norm(after - before, axis=2), axis=(0,))
    assert np.nanmedian(off) < 1e-6
    assert np.nanmax(off) < 2e-3  # of points whose motion would turn a triangle over


def test_the_moved_face_stays_near(made: FaceSimplification) -> None:
    third, tenth = (made.error(made.mesh.level(len(made.model.triangles) // by)) for by in (3, 10))
    assert third < 0.0018
    assert tenth < 0.004


def test_a_level_within_an_error(made: FaceSimplification) -> None:
    level = made.within(0.001)
    assert made.error(level) <= 0.001
    assert len(level.triangles) < len(made.model.triangles) / 2


@pytest.mark.parametrize(
    ("faces", "there", "back"),
    [
        (1307, 5.3, 5.5),
        (680, 9.2, 12.0),
    ],
)
def test_no_sheet_spans_the_face(faces: int, there: float, back: float) -> None:
    """Distances (mm) of 99 % both ways; the first bound is less than what quadrics of this size have."""
    head = replace(FaceModel.default(), levels=())
    level = simplify_face(head, faces).mesh.level(faces)
    full = head.vertices.astype(np.float64)
    middles = level.positions[level.triangles].mean(axis=1)
    away = distances(full, place(full, level.positions, level.triangles), level.positions)
    from_full = distances(middles, place(middles, full, head.triangles), full)
    assert np.percentile(away, 99) < there
    assert np.percentile(from_full, 99) < back


@pytest.mark.parametrize("faces", [22508, 11807, 3690, 2141, 1929, 1307, 900, 700, 680])
def test_every_level_is_valid(faces: int) -> None:
    """`fba model validate` finds no error: 61, 32 and 10 %, stages of the source, and others as coarse."""
    made = simplify_face(replace(FaceModel.default(), levels=()), faces)
    small = made.build(made.mesh.level(faces)).model
    findings = [*check_neutral(small), *check_faps(small)]
    assert not [finding for finding in findings if finding.severity == "error"]


def test_margins_of_lids_and_lips_stay_lines(made: FaceSimplification) -> None:
    """On every level, contours run along vertices of the full face's contours only."""
    head = made.model
    on_lines = head.vertices[find_lines(head) > 0]
    for faces in (11807, 3690, 680):
        small = made.build(made.mesh.level(faces), tables=False).model
        kept = small.vertices[find_lines(small) > 0]
        assert len(kept) > 20
        assert (np.abs(kept[:, None] - on_lines).max(axis=2).min(axis=1) == 0).all()


def test_levels_are_stored_with_the_model(made: FaceSimplification, tmp_path: Path) -> None:
    levels = tuple(made.build(made.mesh.level(faces)) for faces in (2141, 680))
    replace(made.model, levels=levels).save(tmp_path / "head.glb")
    again = FaceModel.load(tmp_path / "head.glb")
    assert [len(level.model.triangles) for level in again.levels] == [2141, 680]
    for before, after in zip(levels, again.levels, strict=True):
        np.testing.assert_array_equal(after.parents, before.parents)
        assert (after.error, after.shape) == (before.error, shape_key(again.parts))
        np.testing.assert_array_equal(after.model.vertices, before.model.vertices)
        assert [part.material for part in after.model.parts] == [part.material for part in made.model.parts]
        values = np.full(FAP_COUNT, 100.0)
        np.testing.assert_array_equal(Deformer(after.model)(values), Deformer(before.model)(values))


def test_levels_that_do_not_belong_are_refused() -> None:
    face = small_face()
    right = DetailLevel(face, np.arange(len(face.vertices)), 0.0, shape_key(face.parts))
    assert replace(face, levels=(right,)).levels == (right,)
    other = replace(face, parts=(replace(face.parts[0], name="x"), *face.parts[1:]), tables=())
    for level, message in (
        (replace(right, parents=np.arange(3)), "parents are needed"),
        (replace(right, parents=np.full(len(face.vertices), len(face.vertices))), "parents beyond"),
        (replace(right, model=replace(face, levels=(right,))), "no levels itself"),
        (replace(right, model=other), "not those of the face"),
        (replace(right, error=float("nan")), "is not a distance"),
    ):
        with pytest.raises(ModelError, match=message):
            replace(face, levels=(level,))
    assert face.with_tables((), {}).levels == ()


def test_other_parts_have_no_levels_of_those_before() -> None:
    face = small_face()
    level = DetailLevel(face, np.arange(len(face.vertices)), 0.0, shape_key(face.parts))
    face = replace(face, levels=(level,))
    first = face.parts[0]
    painted = replace(first, material=replace(first.material, colour=(0.1, 0.2, 0.3)))
    moved = replace(first, vertices=np.where([True, False, False], first.vertices * 1.00001, first.vertices))
    fewer = replace(first, triangles=first.triangles[:-1])
    assert replace(face, parts=(painted, *face.parts[1:])).levels == (level,)
    for other in (moved, fewer):
        assert replace(face, parts=(other, *face.parts[1:])).levels == ()


def test_the_built_in_head_has_levels() -> None:
    """Where this fails, `head.glb` has changed: run python -m tools.figure.make_levels."""
    head = FaceModel.default()
    sizes = [len(level.model.triangles) for level in head.levels]
    assert sizes == level_sizes(head, len(sizes))
    assert len(sizes) == 2
    assert head.levels[0].error < head.levels[1].error < 0.001
    assert [part.material for part in head.levels[0].model.parts] == [part.material for part in head.parts]


def test_level_sizes_fall() -> None:
    head = FaceModel.default()
    sizes = level_sizes(head, 4)
    assert sizes == sorted(sizes, reverse=True)
    assert len(sizes) == 3  # a fourth would have 382 triangles for 9 parts
    assert sizes[0] / len(head.triangles) == pytest.approx(0.32, abs=0.01)


def test_too_few_triangles_are_refused() -> None:
    with pytest.raises(ModelError, match="too few for a face of"):
        simplify_face(FaceModel.default(), 3)


def test_flame_is_reduced_to_the_stages_of_the_source(shared: Path) -> None:
    path = shared / "data" / "foreign" / "heads" / "flame_template.obj"
    if not path.exists():
        pytest.skip("FLAME's template is not at hand")
    mesh = read_obj(path)
    triangles = mesh.corners.reshape(-1, 3)
    assert len(triangles) == len(mesh)
    made = simplify(mesh.vertices[None], triangles, SOURCE_STAGES)
    assert [len(made.level(faces).triangles) for faces in SOURCE_STAGES] == list(SOURCE_STAGES)
