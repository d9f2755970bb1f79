"""glTF heads: ARKit's shapes, shapes named after FAPs, and heads that nobody marked."""

from pathlib import Path

import numpy as np
import pytest

from fba.errors import FbaWarning, ModelError
from fba.face.authoring import add_shapes, author
from fba.face.deform._deformer import Deformer
from fba.face.fapu import Fapu
from fba.face.gltf.morphs import displacements
from fba.face.importers import import_model
from fba.face.importers.assembly._landmarks import find_points
from fba.face.importers.assembly._polygon_parts import Piece
from fba.face.model import FaceModel
from fba.parameters import fap_numbers, faps, point_rows
from mesh_files import write_glb, write_points

BROW = ("raise_l_i_eyebrow", "raise_l_m_eyebrow", "raise_l_o_eyebrow")
HEIGHT = 200
"""Value of the brows at which the shapes of the tests stand."""


def pose(**values: float) -> np.ndarray:
    result = np.zeros(68)
    for name, value in values.items():
        result[fap_numbers()[name] - 1] = value
    return result


def by_part(model: FaceModel, shift: np.ndarray) -> dict[str, np.ndarray]:
    """Displacements of the whole model as those of its parts that move."""
    ends = np.cumsum([len(part.vertices) for part in model.parts])[:-1]
    split = zip(model.parts, np.split(shift, ends), strict=True)
    return {part.name: moved for part, moved in split if np.abs(moved).max() > 0}


def shapes_of(model: FaceModel, **poses: np.ndarray) -> dict[str, dict[str, np.ndarray]]:
    deform = Deformer(model)
    rest = deform.local(np.zeros(68))
    return {name: by_part(model, deform.local(values) - rest) for name, values in poses.items()}


@pytest.fixture(scope="module")
def sculpted(base: FaceModel) -> tuple[dict[str, dict[str, np.ndarray]], np.ndarray]:
    """Shapes as a sculptor makes them, and what he adds between the points: a swelling above the brow.

    The brow goes up in two shapes, one for both sides, and a smile raises and widens.
    """
    shapes = shapes_of(
        base,
        browInnerUp=pose(raise_l_i_eyebrow=HEIGHT, raise_r_i_eyebrow=HEIGHT),
        browOuterUpLeft=pose(raise_l_m_eyebrow=HEIGHT, raise_l_o_eyebrow=HEIGHT),
        browOuterUpRight=pose(raise_r_m_eyebrow=HEIGHT, raise_r_o_eyebrow=HEIGHT),
        mouthSmileLeft=pose(
            raise_l_cornerlip=60, raise_l_cornerlip_o=60, stretch_l_cornerlip=20, stretch_l_cornerlip_o=20
        ),
    )
    vertices = base.part("skin").vertices.astype(np.float64)
    points = base.points[[point_rows()[name] for name in ("4.1", "4.3", "4.5")]]
    spot = points[1] * 0.5 + points[0] * 0.5 + (0, 0.004, 0)
    away = np.linalg.norm(vertices - spot, axis=1)
    swelling = np.zeros_like(vertices)
    swelling[:, 2] = 0.004 * np.exp(-((away / 0.006) ** 2))
    shapes["browInnerUp"]["skin"] = shapes["browInnerUp"]["skin"] + swelling.astype(np.float32)
    return shapes, swelling


@pytest.fixture(scope="module")
def shaped(base: FaceModel, sculpted: tuple[dict[str, dict[str, np.ndarray]], np.ndarray]) -> FaceModel:
    return add_shapes(author(base.parts, base.points, bound=base.bound), sculpted[0])


def test_brows_use_the_shapes_and_the_smile_too(shaped: FaceModel) -> None:
    for name in ("browInnerUp", "browOuterUpLeft", "browOuterUpRight"):
        assert name in shaped.notes["shapes"]
    assert not shaped.lost or max(shaped.lost) <= 68


def test_together_the_faps_of_a_brow_show_the_shape(
    base: FaceModel, shaped: FaceModel, sculpted: tuple[dict[str, dict[str, np.ndarray]], np.ndarray]
) -> None:
    shapes, swelling = sculpted
    deform = Deformer(shaped)
    up = deform(pose(**dict.fromkeys(BROW, HEIGHT))) - deform(np.zeros(68))
    found = up[: len(swelling)]
    wanted = shapes["browInnerUp"]["skin"] + shapes["browOuterUpLeft"]["skin"]
    # well inside the left brow's region, where the shapes show in full
    inside = np.linalg.norm(wanted, axis=1) > 0.5 * np.linalg.norm(wanted, axis=1).max()
    inside &= base.part("skin").vertices[:, 0] > 0.008
    assert inside.sum() > 10
    most = np.linalg.norm(wanted, axis=1).max()
    assert np.abs(found - wanted)[inside].max() < 0.12 * most
    # the swelling is the sculptor's alone: tables of the bare mesh know nothing of it
    top = int(swelling[:, 2].argmax())
    plain = Deformer(base)
    bare = plain(pose(**dict.fromkeys(BROW, HEIGHT))) - plain(np.zeros(68))
    assert found[top, 2] - bare[top, 2] > 0.5 * swelling[top, 2]


@pytest.mark.parametrize("fap", [*BROW, "raise_r_i_eyebrow", "raise_l_cornerlip_o", "stretch_l_cornerlip_o"])
@pytest.mark.parametrize("value", [40, -40])
def test_points_move_exactly_and_others_stay(shaped: FaceModel, fap: str, value: float) -> None:
    entry = faps()[fap_numbers()[fap] - 1]
    deform = Deformer(shaped)
    small = 10 if "cornerlip" in fap else value
    moved = deform.feature_points(pose(**{fap: small})) - deform.feature_points(np.zeros(68))
    way = {"up": (0, 1, 0), "left": (1, 0, 0)}[entry.positive]
    expected = small * shaped.fapu[entry.unit] * np.array(way)
    row = point_rows()[entry.feature_points[0]]
    np.testing.assert_allclose(moved[row], expected, atol=0.05 * np.linalg.norm(expected))
    mate = faps()[(entry.left_right_mate or 0) - 1].feature_points[0]
    assert np.linalg.norm(moved[point_rows()[mate]]) < 0.02 * np.linalg.norm(expected)


def test_no_triangle_turns_over_at_the_limits(shaped: FaceModel) -> None:
    deform = Deformer(shaped)
    triangles = shaped.part("skin").triangles

    def normals(values: np.ndarray) -> np.ndarray:
        a, b, c = (deform(values)[triangles[:, k]] for k in range(3))
        return np.cross(b - a, c - a)

    rest = normals(np.zeros(68))
    sound = np.linalg.norm(rest, axis=1) > 1e-3 * np.median(np.linalg.norm(rest, axis=1))
    for fap in (*BROW, "raise_l_cornerlip_o"):
        entry = faps()[fap_numbers()[fap] - 1]
        assert entry.i_limits is not None
        for limit in entry.i_limits:
            dots = (normals(pose(**{fap: limit * entry.step})) * rest).sum(axis=1)
            assert (dots[sound] > 0).all()


def test_shapes_that_nobody_knows_are_said(base: FaceModel) -> None:
    moved = np.ones((len(base.part("skin").vertices), 3), dtype=np.float32)
    with pytest.warns(FbaWarning, match="none of the 1 shapes is named after"):
        model = add_shapes(author(base.parts, base.points, bound=base.bound), {"wobble": {"skin": moved}})
    assert {table.fap for table in model.tables} == {table.fap for table in base.tables}


@pytest.mark.parametrize(
    ("moved", "words"),
    [
        ({"nose": np.zeros((3, 3))}, "no such part"),
        ({"skin": np.zeros((3, 3))}, "displacements must be"),
        ({"tongue": None}, "not finite"),
    ],
)
def test_bad_shapes(base: FaceModel, moved: dict[str, np.ndarray | None], words: str) -> None:
    given = {
        part: np.full((len(base.part(part).vertices), 3), np.nan) if array is None else array
        for part, array in moved.items()
    }
    with pytest.raises(ModelError, match=words):
        add_shapes(author(base.parts, base.points, bound=base.bound), {"jawOpen": given})


def test_shapes_named_after_faps_are_taken_at_their_word(base: FaceModel, tmp_path: Path) -> None:
    """A saved model of this project that some program wrote again, without the extension."""
    shapes = {faps()[number - 1].name: by_part(base, shift) for number, shift in displacements(base)}
    write_glb(tmp_path / "face.glb", base.parts, shapes)
    write_points(tmp_path / "face.points.csv", base)
    model = import_model(tmp_path / "face.glb")
    assert {table.fap for table in model.tables} == {table.fap for table in base.tables}
    before, after = Deformer(base), Deformer(model)
    for values in (
        pose(raise_l_m_eyebrow=150),
        pose(lift_r_cheek=100),
        pose(open_jaw=300),
        pose(yaw_l_eyeball=20000, yaw_r_eyeball=20000),
    ):
        wanted = before(values) - before(np.zeros(68))
        found = after(values) - after(np.zeros(68))
        assert np.abs(found - wanted).max() < 0.05 * np.abs(wanted).max() + 2e-6


def test_own_models_are_simply_loaded(base: FaceModel, tmp_path: Path) -> None:
    base.save(tmp_path / "own.glb")
    model = import_model(tmp_path / "own.glb")
    np.testing.assert_array_equal(model.bound, base.bound)
    assert [table.fap for table in model.tables] == [table.fap for table in base.tables]


def test_feature_points_of_an_unmarked_head_are_found() -> None:
    """On the built-in head, whose points are known; its shapes are its own FAPs at large values."""
    head = FaceModel.default()
    lower_lip = dict.fromkeys(
        (n for n in fap_numbers() if n.startswith(("raise_b_midlip", "raise_b_lip"))), -700.0
    )
    smile = {"stretch_{}_cornerlip": 150.0, "raise_{}_cornerlip": 200.0}

    def corner(side: str) -> np.ndarray:
        names = {f"{k.format(side)}{end}": v for k, v in smile.items() for end in ("", "_o")}
        return pose(**names)

    shapes = shapes_of(
        head,
        eyeBlinkLeft=pose(close_t_l_eyelid=1024),
        eyeBlinkRight=pose(close_t_r_eyelid=1024),
        jawOpen=pose(open_jaw=800, **lower_lip),
        mouthSmileLeft=corner("l"),
        mouthSmileRight=corner("r"),
    )
    kinds = {part.name: part.name for part in head.parts}
    pieces = []
    for part in head.parts:
        zero = np.zeros_like(part.vertices)
        pieces.append(Piece(part, "", morphs={s: by.get(kinds[part.name], zero) for s, by in shapes.items()}))
    found = find_points(pieces, "head.glb")
    fapu, wanted = Fapu.measure(found), head.fapu
    for unit in ("IRISD", "ES", "ENS", "MNS", "MW"):
        assert fapu[unit] == pytest.approx(wanted[unit], rel=0.12), unit
    away = np.linalg.norm(found - head.points, axis=1) * 1000
    row = point_rows()
    # The ears are an average adult's: nothing shows where they are.
    for name, most in (
        ("3.1", 1.5), ("3.2", 1.5), ("3.3", 2), ("3.4", 2), ("2.2", 2), ("2.3", 2), ("8.3", 5), ("8.4", 5),
        ("2.4", 4), ("2.5", 4), ("9.3", 3), ("9.15", 4), ("2.1", 8), ("2.10", 6), ("8.1", 3), ("8.2", 7),
        ("4.1", 8), ("4.3", 8), ("5.1", 12), ("9.1", 6), ("10.1", 25),
    ):  # fmt: skip
        assert away[row[name]] < most, (name, away[row[name]])


def test_what_is_missing_for_finding_points_is_said(base: FaceModel, tmp_path: Path) -> None:
    write_glb(tmp_path / "a.glb", [base.part("skin")], shapes_of(base, jawOpen=pose(open_jaw=300)))
    with pytest.raises(ModelError, match=r"left eye and the right eye \(feature points 3\.5 and 3\.6\)"):
        import_model(tmp_path / "a.glb")
    shapes = shapes_of(base, eyeBlink_L=pose(close_t_l_eyelid=1024))
    write_glb(tmp_path / "b.glb", base.parts, shapes)
    with pytest.raises(ModelError, match=r"eyeBlinkRight, jawOpen are missing.*points=FILE"):
        import_model(tmp_path / "b.glb")
    write_glb(tmp_path / "c.glb", [base.part("left eye")])
    with pytest.raises(ModelError, match=r"right eye|part is skin"):
        import_model(tmp_path / "c.glb")
