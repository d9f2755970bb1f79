"""Heads of drawn figures: flat eyes, shapes of both sides, mouths by the edge of the skin, visemes."""

from dataclasses import replace

import numpy as np
import pytest

from fba.face.authoring import author
from fba.face.deform._deformer import Deformer
from fba.face.eyeball import eyeballs, fit_eyeball, flat_width
from fba.face.importers._shaped import match_sides
from fba.face.importers.assembly._definitions import define_by_shapes, named_shapes
from fba.face.importers.assembly._landmarks import find_eyes
from fba.face.importers.assembly._outlines import mouth_points
from fba.face.importers.assembly._pieces import assemble
from fba.face.importers.assembly._polygon_parts import Piece
from fba.face.model import FaceModel, Part
from fba.parameters import fap_numbers, point_rows
from small_head import small_head


def dome(depth: float, x: float = 0.0, name: str = "eye", *, hub: bool = False) -> Part:
    """The front of a ball of radius 1 cm, flattened to a depth by the radius, about x."""
    turn, tilt = np.meshgrid(np.arange(12) * np.pi / 6, np.linspace(0.15, np.pi / 2, 7))
    ring = np.stack([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt) * depth], axis=-1)
    vertices = [*ring.reshape(-1, 3), (0.0, 0.0, depth), *([(0.0, 0.0, 0.02)] if hub else [])]
    triangles = [(k, k + 1, k + 12) for k in range(71)]
    return Part(
        name,
        "eye",
        (np.array(vertices) * 0.01 + (x, 0, 0)).astype(np.float32),
        np.array(triangles, dtype=np.int32),
    )


def test_a_flat_eye_turns_about_a_ball_behind_its_pupil() -> None:
    assert flat_width(dome(1.0)) is None
    flat = dome(0.1)
    assert flat_width(flat) == pytest.approx(0.02, rel=0.01)
    fitted = fit_eyeball(flat, np.array([0.0, 0.0, 0.001]))
    assert fitted is not None
    centre, radius, _, _ = fitted
    # a person's iris of 11.7 mm is on a ball of 24 mm
    assert radius == pytest.approx(0.02 * 12 / 11.7, rel=0.01)
    np.testing.assert_allclose(centre, (0, 0, 0.001 - radius), atol=1e-9)


def test_the_whites_of_drawn_eyes_stay() -> None:
    pieces = [
        Piece(replace(dome(depth, x, f"{name}_{x}"), kind="other"))
        for x in (-0.03, 0.03)
        for name, depth in (("EyeIris", 0.1), ("EyeWhite", 0.2))
    ]
    kinds = {piece.part.name: piece.part.kind for piece in assemble([*pieces, Piece(small_head().parts[0])])}
    assert kinds["left eye"] == kinds["right eye"] == "eye"
    assert [kind for name, kind in kinds.items() if name.startswith("EyeWhite")] == ["other", "other"]


def test_the_white_of_a_ball_turns_with_its_iris() -> None:
    pieces = [
        Piece(dome(depth, x, f"{name}_{x}"))
        for x in (-0.03, 0.03)
        for name, depth in (("Iris", 0.1), ("Sclera", 1.0))
    ]
    names = [piece.part.name for piece in assemble([*pieces, Piece(small_head().parts[0])])]
    assert not any(name.startswith("Sclera") for name in names)


def test_the_pupil_is_at_the_front_of_half_a_ball() -> None:
    pieces = [Piece(dome(1.0, x, name, hub=True)) for x, name in ((-0.03, "right eye"), (0.03, "left eye"))]
    for centre, radius, pupil in find_eyes(pieces, "a.glb").values():
        assert pupil[2] - centre[2] > 0.9 * radius


def test_shapes_of_both_sides_become_shapes_of_each() -> None:
    vertices = np.array([(x, 0, 0) for x in (0.1, 0.2, 0.3, 0.4)], dtype=np.float32)
    part = Part("skin", "skin", vertices, np.array([(0, 1, 2), (1, 2, 3)], dtype=np.int32))
    blink = np.tile(np.array([0, -1, 0], dtype=np.float32), (4, 1))
    own = {"mouthSmile": blink, "mouthSmileLeft": blink * 2}
    (piece,) = match_sides([Piece(part, morphs={"Fcl_EYE_Close": blink, **own})])
    # the middle is that of what moves, not of the file
    assert piece.morphs["eyeBlinkLeft"][:, 1].tolist() == [0, 0, -1, -1]
    assert piece.morphs["eyeBlinkRight"][:, 1].tolist() == [-1, -1, 0, 0]
    assert piece.morphs["mouthSmileLeft"] is own["mouthSmileLeft"]
    assert "mouthSmileRight" not in piece.morphs


def test_shapes_of_each_side_become_one_of_both() -> None:
    vertices = np.array([(x, 0, 0) for x in (0.1, 0.2, 0.3)], dtype=np.float32)
    part = Part("skin", "skin", vertices, np.array([(0, 1, 2)], dtype=np.int32))
    left, right = np.zeros((2, 3, 3), dtype=np.float32)
    left[2], right[0] = (0.2, 0, 0), (-0.1, 0, 0)
    morphs = {"cheekPuff_L": left, "cheekPuff_R": right, "browInnerUp_L": left, "noseSneer_R": right}
    (piece,) = match_sides([Piece(part, morphs=morphs)])
    np.testing.assert_array_equal(piece.morphs["cheekPuff"], left + right)
    assert set(piece.morphs) == {*morphs, "cheekPuff"}  # one half is no whole


def slit_sheet() -> tuple[Part, np.ndarray]:
    """A sheet of 21 x 21 vertices, 5 mm apart, with a slit from x = -2 to 3 cm; how far each falls."""
    x, y = np.meshgrid(np.arange(-10, 11) * 0.005, np.arange(-10, 11) * 0.005)
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    on_slit = np.flatnonzero(
        (np.abs(vertices[:, 1]) < 1e-9) & (vertices[:, 0] > -0.0199) & (vertices[:, 0] < 0.0299)
    )
    lower = np.arange(len(vertices))
    lower[on_slit] = len(vertices) + np.arange(len(on_slit))
    triangles = []
    for row in range(20):
        for column in range(20):
            a = row * 21 + column
            corners = [(a, a + 1, a + 21), (a + 1, a + 22, a + 21)]
            triangles += [tuple(lower[list(each)]) if row < 10 else each for each in corners]
    both = np.concatenate([vertices, vertices[on_slit] - (0, 0.001, 0)])
    drop = np.where(both[:, 1] < -1e-9, 0.01, 0.0)
    part = Part("skin", "skin", both.astype(np.float32), np.array(triangles, dtype=np.int32))
    return part, drop


def test_lips_meet_where_the_skin_ends() -> None:
    part, drop = slit_sheet()
    lips = np.array([0.0, 0.0, 0.0]), np.array([0.0, -0.001, 0.0])
    found = mouth_points(part, drop, *lips, 0.06)
    assert found["2.4"][0] == pytest.approx(0.03)
    assert found["2.5"][0] == pytest.approx(-0.02)
    assert (found["2.2"][1], found["2.3"][1]) == pytest.approx((0.0, -0.001))
    assert found["2.6"][0] == found["2.8"][0] == pytest.approx(0.015)
    assert found["2.7"][0] == pytest.approx(-0.01)
    # a loop somewhere else, such as the neck, is no mouth
    assert mouth_points(part, drop, lips[0] + (0, 0.04, 0), lips[1] + (0, 0.04, 0), 0.06) == {}


def shape_of(model: FaceModel, faps: dict[str, float]) -> dict[str, np.ndarray]:
    values = np.zeros(68)
    for name, value in faps.items():
        values[fap_numbers()[name] - 1] = value
    deform = Deformer(model)
    moved = deform(values) - deform(np.zeros(68))
    return {
        part.name: moved[model.starts[part.name] :][: len(part.vertices)]
        for part in model.parts
        if part.kind == "skin"
    }


def test_visemes_and_expressions_are_those_of_the_shapes(base: FaceModel) -> None:
    rounded = {"stretch_l_cornerlip": -100.0, "stretch_r_cornerlip": -100.0}
    rounded |= {f"{name}_o": value for name, value in rounded.items()}
    raised = {f"raise_{side}_{where}_eyebrow": 120.0 for side in "lr" for where in "imo"}
    morphs = {
        "viseme_U": shape_of(base, rounded),
        "viseme_aa": shape_of(base, {"open_jaw": 400}),
        "Fcl_ALL_Surprised": shape_of(base, raised),
        "viseme_PP": {"skin": np.zeros((len(base.part("skin").vertices), 3))},
    }
    made = define_by_shapes(base, morphs)
    u = made.definitions.visemes[14]
    for name, value in rounded.items():
        assert u[fap_numbers()[name] - 1] == pytest.approx(value, abs=12), name
    assert u[fap_numbers()["open_jaw"] - 1] == pytest.approx(0, abs=10)
    # the jaw takes the lips along: they need no FAPs of their own
    aa = made.definitions.visemes[10]
    assert aa[fap_numbers()["open_jaw"] - 1] == pytest.approx(400, rel=0.05)
    for name in ("raise_b_midlip", "raise_b_midlip_o", "stretch_l_cornerlip"):
        assert aa[fap_numbers()[name] - 1] == pytest.approx(0, abs=25), name
    surprise = made.definitions.expressions[6]
    for name, value in raised.items():
        assert surprise[fap_numbers()[name] - 1] == pytest.approx(value, abs=12), name
    # an empty shape, and those that the file has not, leave ours
    for select in (1, 11):
        np.testing.assert_array_equal(made.definitions.visemes[select], base.definitions.visemes[select])
    assert made.notes["visemes and expressions"].endswith("surprise, A:, U")


def test_a_shape_that_no_fap_can_show_leaves_ours(base: FaceModel) -> None:
    aside = np.zeros((len(base.part("skin").vertices), 3))
    aside[base.bound[point_rows()["2.2"]] - base.starts["skin"], 0] = 0.005
    assert define_by_shapes(base, {"viseme_nn": {"skin": aside}}) is base


def test_a_lopsided_shape_gives_both_sides_the_same(base: FaceModel) -> None:
    made = define_by_shapes(
        base, {"joy": shape_of(base, {"raise_l_cornerlip": 100.0, "raise_l_cornerlip_o": 100.0})}
    )
    joy = made.definitions.expressions[1]
    left, right = (joy[fap_numbers()[f"raise_{side}_cornerlip"] - 1] for side in "lr")
    assert left == right == pytest.approx(50, abs=8)


def test_names_of_visemes() -> None:
    names = ("Face.vrc.v_oh", "viseme_sil", "viseme_aa", "Fcl_MTH_A", "browDownLeft", "head|happy")
    assert named_shapes(names) == {
        ("expression", 1): "head|happy",
        ("viseme", 10): "viseme_aa",
        ("viseme", 13): "Face.vrc.v_oh",
    }


def test_eyes_of_a_model_with_flat_eyes_look_ahead(base: FaceModel) -> None:
    parts = tuple(
        replace(dome(0.1, 0.03 if "left" in part.name else -0.03, part.name)) if part.kind == "eye" else part
        for part in base.parts
    )
    points = base.points.copy()
    for name, x in (("3.5", 0.03), ("3.6", -0.03)):
        points[point_rows()[name]] = (x, 0.0, 0.001)
    model = author(parts, points)
    for eye in eyeballs(model).values():
        pupil = model.points[point_rows()["3.5" if eye.side == "left" else "3.6"]]
        np.testing.assert_allclose((pupil - eye.centre)[:2], 0, atol=1e-6)
