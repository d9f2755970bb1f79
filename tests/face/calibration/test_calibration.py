"""Fitting a face to a person: through all given points, whatever their unit and pose, or an error."""

import contextlib
import itertools
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fba.errors import FbaWarning, ModelError
from fba.face.calibration import UNITS, fit, points_of_distances
from fba.face.calibration._align import align
from fba.face.calibration._carry import surface_stretches
from fba.face.calibration._field import turned_over_triangles
from fba.face.checks._findings import Finding
from fba.face.eyeball import eyeballs
from fba.face.fapu import Fapu
from fba.face.feature_points import MIRRORED, names
from fba.face.model import FaceModel, Part
from fba.mesh._meshes import vertex_normals
from fba.parameters import point_rows
from small_head import EYE_RADIUS, small_head

ROW = point_rows()
RIGID = {"9.8", "9.9", "9.10", "9.11"}
"""Points of the teeth, which stay rigid."""
SOFT = [row for name, row in ROW.items() if name not in RIGID]


@pytest.fixture(scope="module")
def small() -> FaceModel:
    return small_head()


@pytest.fixture(scope="module")
def head() -> FaceModel:
    return FaceModel.default()


def rotation(seed: int) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return Rotation.random(random_state=seed).as_matrix()


def person(model: FaceModel, seed: int, spread: float = 0.0006) -> np.ndarray:
    """The model's points as another person's: wider or longer by a few per cent, and all a little elsewhere.

    Symmetric, lips shut, the pupils in the middle of the lids: a neutral face.
    """
    rng = np.random.default_rng(seed)
    points = model.points * rng.uniform(0.9, 1.1, size=3)
    waves = rng.uniform(20, 60, size=(5, 3)), rng.uniform(0, 6, size=(5, 1))
    phase = np.abs(model.points) @ (waves[0] * (0.5, 1, 1)).T + waves[1].T
    shift = np.sin(phase) @ rng.normal(scale=spread, size=(5, 3))
    shift[:, 0] *= np.tanh(model.points[:, 0] / 0.01)
    for upper, lower in (("2.2", "2.3"), ("2.6", "2.8"), ("2.7", "2.9"), ("9.10", "9.11")):
        shift[ROW[lower]] = shift[ROW[upper]]
    for eye in (("3.5", "3.1", "3.3"), ("3.6", "3.2", "3.4")):
        shift[[ROW[name] for name in eye]] = shift[ROW[eye[0]]]
    return points + shift


def centred(points: np.ndarray, model: FaceModel) -> np.ndarray:
    pupils = [ROW["3.5"], ROW["3.6"]]
    return points - points[pupils].mean(axis=0) + model.points[pupils].mean(axis=0)


@pytest.mark.parametrize("seed", range(6))
def test_the_fitted_points_are_the_given_ones(small: FaceModel, seed: int) -> None:
    given = person(small, seed)
    fitted = fit(small, given * 1000)
    wanted = centred(given, small)
    np.testing.assert_allclose(fitted.points[SOFT], wanted[SOFT], atol=1e-6)
    bound = np.flatnonzero(small.bound >= 0)
    np.testing.assert_array_equal(fitted.points[bound], fitted.vertices[small.bound[bound]])
    expected = Fapu.measure(given)
    for unit in ("IRISD", "ES", "ENS", "MNS", "MW"):
        assert fitted.fapu[unit] == pytest.approx(expected[unit], abs=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_the_same_on_the_built_in_head(head: FaceModel, seed: int) -> None:
    given = person(head, seed)
    fitted = fit(head, given, unit="m", tables="carry")
    np.testing.assert_allclose(fitted.points[SOFT], centred(given, head)[SOFT], atol=1e-6)
    assert [part.name for part in fitted.parts] == [part.name for part in head.parts]
    assert {table.fap for table in fitted.tables} == {table.fap for table in head.tables}


def test_fitting_a_face_to_itself_changes_nothing(head: FaceModel) -> None:
    fitted = fit(head, head.points * 100, tables="carry")
    np.testing.assert_allclose(fitted.vertices, head.vertices, atol=2e-5)
    for before, after in zip(head.tables, fitted.tables, strict=True):
        for old, new in zip(before.meshes, after.meshes, strict=True):
            np.testing.assert_allclose(new.displacements, old.displacements, atol=0.02)


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("turn", [0, 1, 2])
def test_any_unit_and_any_pose(small: FaceModel, unit: str, turn: int) -> None:
    """A big rotation is undone; the file's unit is found, but for inches, which have to be named."""
    given = person(small, 3)
    pose = np.eye(3) if turn == 0 else rotation(turn)
    placed = given @ pose.T / UNITS[unit] + (3, -200, 50)
    fitted = fit(small, placed, unit=unit if unit == "in" else None)
    wanted = centred(given, small)
    # The pose of a chance rotation is only known as well as the person resembles the model.
    apart = np.linalg.norm(fitted.points[SOFT][:, None] - fitted.points[SOFT][None], axis=2)
    true = np.linalg.norm(wanted[SOFT][:, None] - wanted[SOFT][None], axis=2)
    np.testing.assert_allclose(apart, true, atol=2e-6)
    if turn == 0:
        np.testing.assert_allclose(fitted.points[SOFT], wanted[SOFT], atol=1e-6)
    else:
        assert np.abs(fitted.points[SOFT] - wanted[SOFT]).max() < 0.012


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_axes_of_other_programs(small: FaceModel, order: tuple[int, ...]) -> None:
    """z up, x forward and the like are undone exactly, not as well as a least squares fit can."""
    axes = np.zeros((3, 3))
    axes[range(3), order] = 1
    if np.linalg.det(axes) < 0:
        axes[0] *= -1
    given = person(small, 4)
    fitted = fit(small, given @ axes.T)
    np.testing.assert_allclose(fitted.points[SOFT], centred(given, small)[SOFT], atol=1e-6)


def test_a_size_without_unit_is_taken_from_the_face(small: FaceModel) -> None:
    given = person(small, 5)
    fitted = fit(small, given * 17)
    pupils = [ROW["3.5"], ROW["3.6"]]
    assert np.ptp(fitted.points[pupils, 0]) == pytest.approx(np.ptp(small.points[pupils, 0]), rel=0.15)
    assert "without a unit" in fitted.notes["fitted"]


def test_a_child_stays_small(small: FaceModel) -> None:
    fitted = fit(small, small.points * 800)
    np.testing.assert_allclose(fitted.points[SOFT], small.points[SOFT] * 0.8, atol=1e-6)
    assert eyeballs(fitted)["left"].radius == pytest.approx(0.8 * EYE_RADIUS, rel=0.01)


def test_a_mirrored_face_is_said_to_be_one(small: FaceModel) -> None:
    given = person(small, 6) * (-1000, 1000, 1000)
    with pytest.warns(FbaWarning, match="mirrored face"):
        fitted = fit(small, given)
    np.testing.assert_allclose(
        fitted.points[SOFT], centred(given * (-1, 1, 1) / 1000, small)[SOFT], atol=1e-6
    )


def test_a_photograph_has_no_depth(small: FaceModel) -> None:
    """Points in a plane, y down as in pictures: the depth is the model's."""
    given = person(small, 7)
    picture = np.column_stack([given[:, 0] * 4000 + 320, 240 - given[:, 1] * 4000, np.zeros(84)])
    fitted = fit(small, picture)
    wanted = centred(given, small)
    size = np.ptp(fitted.points[SOFT, 0]) / np.ptp(wanted[SOFT, 0])
    np.testing.assert_allclose(fitted.points[SOFT, :2], wanted[SOFT, :2] * size, atol=0.0006)
    np.testing.assert_allclose(fitted.points[SOFT, 2], small.points[SOFT, 2], atol=0.004)


def test_a_missing_side_is_the_mirror_of_the_other(small: FaceModel) -> None:
    given = person(small, 8)
    half = given.copy()
    for right in MIRRORED.values():
        if right not in {"3.6", "3.2", "3.4"}:
            half[ROW[right]] = np.nan
    fitted = fit(small, half)
    np.testing.assert_allclose(fitted.points[SOFT], centred(given, small)[SOFT], atol=2e-6)
    assert "8.4" in fitted.notes["fitted"]


def test_points_that_nobody_knows_follow_the_others(small: FaceModel) -> None:
    given = person(small, 9) * 1000
    few = np.full_like(given, np.nan)
    for name in ("3.5", "3.6", "9.15", "2.2", "8.3", "8.4", "3.1", "3.3", "2.1", "9.3"):
        few[ROW[name]] = given[ROW[name]]
    fitted = fit(small, few)
    assert np.isfinite(fitted.points).all()
    wanted = centred(given / 1000, small)
    known = [row for row in SOFT if np.isfinite(few[row, 0])]
    np.testing.assert_allclose(fitted.points[known], wanted[known], atol=1e-6)
    assert np.linalg.norm(fitted.points[SOFT] - wanted[SOFT], axis=1).max() < 0.03


@pytest.mark.parametrize("seed", range(4))
def test_eyeballs_stay_spheres_under_the_lids(head: FaceModel, seed: int) -> None:
    fitted = fit(head, person(head, 20 + seed), tables="carry")
    before, after = eyeballs(head), eyeballs(fitted)
    for side in ("left", "right"):
        assert after[side].error < 1e-6
        assert after[side].share == pytest.approx(before[side].share, abs=0.02)
        skin, was = fitted.part("skin").vertices, head.part("skin").vertices
        outside = np.linalg.norm(was - before[side].centre, axis=1) >= before[side].radius
        assert np.linalg.norm(skin[outside] - after[side].centre, axis=1).min() > after[side].radius - 1e-6
        lids = np.linalg.norm(was - before[side].centre, axis=1) < 1.05 * before[side].radius
        clear = np.linalg.norm(was[lids] - before[side].centre, axis=1) / before[side].radius
        now = np.linalg.norm(skin[lids] - after[side].centre, axis=1) / after[side].radius
        assert np.abs(now - clear).mean() < 0.04
        pupil = fitted.points[ROW[{"left": "3.5", "right": "3.6"}[side]]]
        assert np.linalg.norm((pupil - after[side].centre)[:2]) < 5e-5  # gaze along +z


def test_the_iris_is_as_wide_as_the_lids_are_open(head: FaceModel) -> None:
    """The ring of vertices at the edge of the iris, 10.8 mm across before, is IRISD0 across afterwards."""
    given = person(head, 30)
    for upper, lower in (("3.1", "3.3"), ("3.2", "3.4")):
        given[ROW[upper], 1] += 0.0006
        given[ROW[lower], 1] -= 0.0006
    fitted = fit(head, given, tables="carry")
    before, after = eyeballs(head)["left"], eyeballs(fitted)["left"]

    def across(model: FaceModel, eye: object) -> np.ndarray:
        arms = model.part("eye_left").vertices - eye.centre  # type: ignore[attr-defined]
        return 2 * np.where(arms[:, 2] > 0, np.hypot(arms[:, 0], arms[:, 1]), np.inf)

    iris = head.fapu.IRISD * 1024
    rim = np.abs(across(head, before) - iris) < 0.0002
    assert rim.sum() > 10
    ratio = across(fitted, after)[rim] / across(head, before)[rim]
    np.testing.assert_allclose(ratio, fitted.fapu.IRISD / head.fapu.IRISD, rtol=0.01)


def test_teeth_stay_rigid_and_meet(head: FaceModel) -> None:
    fitted = fit(head, person(head, 31), tables="carry")
    for part in head.of_kind("teeth"):
        old = part.vertices.astype(np.float64)
        new = fitted.part(part.name).vertices.astype(np.float64)
        sizes = np.linalg.norm(new[1:] - new[:-1], axis=1) / np.linalg.norm(old[1:] - old[:-1], axis=1)
        np.testing.assert_allclose(sizes, sizes.mean(), rtol=1e-3)


@pytest.mark.parametrize("gap", [0.004, -0.002])
def test_an_open_mouth_is_shut(small: FaceModel, gap: float) -> None:
    given = small.points.copy()
    for name in ("2.3", "2.8", "2.9", "8.2", "8.7", "8.8"):
        given[ROW[name], 1] -= gap
    with pytest.warns(FbaWarning, match="the mouth is open by 4.0 mm" if gap > 0 else "lower lip"):
        fitted = fit(small, given)
    np.testing.assert_allclose(fitted.points[SOFT], small.points[SOFT], atol=1e-6)


def test_two_points_on_one_spot(small: FaceModel) -> None:
    """As in a file where somebody forgot to change a copied line: 4.3 where 4.1 is."""
    given = person(small, 10)
    given[ROW["4.3"]] = given[ROW["4.1"]]
    with pytest.warns(FbaWarning, match=r"4\.3 is left out"):
        fitted = fit(small, given)
    mirror = fitted.points[ROW["4.4"]] * (-1, 1, 1)
    np.testing.assert_allclose(fitted.points[ROW["4.3"]], mirror, atol=1e-6)


def test_corners_that_changed_places(small: FaceModel) -> None:
    given = person(small, 19)
    wanted = centred(given, small)
    given[[ROW["3.8"], ROW["3.12"]]] = given[[ROW["3.12"], ROW["3.8"]]]
    with pytest.warns(FbaWarning, match=r"3\.8 and 3\.12 have changed places"):
        fitted = fit(small, given @ np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]]) * 1000)
    np.testing.assert_allclose(fitted.points[SOFT], wanted[SOFT], atol=1e-6)


def test_one_point_far_away(small: FaceModel) -> None:
    given = person(small, 11)
    given[ROW["9.3"]] += (0.0, 0.09, 0.05)
    with pytest.warns(FbaWarning, match=r"9\.3 is \d+ mm from its position by the other points"):
        fitted = fit(small, given)
    assert fitted.points[ROW["9.3"], 1] < -0.02


def test_a_pupil_out_of_the_middle_of_the_lids(small: FaceModel) -> None:
    given = person(small, 12)
    given[[ROW["3.5"], ROW["3.6"]], 1] -= 0.0045
    with pytest.warns(FbaWarning, match="middle between the lids"):
        fitted = fit(small, given)
    for pupil, upper, lower in (("3.5", "3.1", "3.3"), ("3.6", "3.2", "3.4")):
        lids = fitted.points[[ROW[upper], ROW[lower]], 1].mean()
        assert fitted.points[ROW[pupil], 1] == pytest.approx(lids, abs=1e-4)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda p: p[:80], r"shape \(84, 3\)"),
        (lambda p: p * np.nan, "only 0 feature points"),
        (lambda p: np.where(np.arange(84)[:, None] < 3, p, np.nan), "only 3 feature points"),
        (lambda p: p * 0 + 5, "coincide"),
        (lambda p: p * (0, 1, 0), "one line"),
        (lambda p: p * 1e12, "no usable position"),
        (lambda p: np.where(p == p[5, 1], np.inf, p), "feature point 2.6 .* no usable position"),
        (lambda p: np.where(p == p[5, 1], np.nan, p), "feature point 2.6 .* no usable position"),
    ],
)
def test_points_that_are_not_those_of_a_face_are_refused(small: FaceModel, change: object, text: str) -> None:
    given = person(small, 13)
    with pytest.raises(ModelError, match=text):
        fit(small, change(given))  # type: ignore[operator]


def test_lids_upside_down_are_refused(small: FaceModel) -> None:
    given = person(small, 14)
    given[[ROW["3.1"], ROW["3.3"], ROW["3.2"], ROW["3.4"]]] = given[
        [ROW["3.3"], ROW["3.1"], ROW["3.4"], ROW["3.2"]]
    ]
    with pytest.raises(ModelError, match="upper lid"):
        fit(small, given)


def test_a_face_that_would_fold_is_refused_and_the_points_are_named(small: FaceModel) -> None:
    given = person(small, 15)
    swapped = ["8.1", "9.15"], ["9.15", "8.1"]
    given[[ROW[name] for name in swapped[0]]] = given[[ROW[name] for name in swapped[1]]]
    with pytest.raises(ModelError, match=r"fold.*(8\.1|9\.15)"):
        fit(small, given)


@pytest.mark.parametrize("seed", range(20))
def test_noise_never_crashes(small: FaceModel, seed: int) -> None:
    """Whatever numbers come: a model or a ModelError."""
    rng = np.random.default_rng(seed)
    given = person(small, seed) + rng.normal(scale=10.0 ** rng.uniform(-4, 0), size=(84, 3))
    given[rng.random(84) < rng.uniform(0, 0.9)] = np.nan
    with warnings.catch_warnings(action="ignore", category=FbaWarning), contextlib.suppress(ModelError):
        assert np.isfinite(fit(small, given).vertices).all()


def test_unknown_options(small: FaceModel) -> None:
    with pytest.raises(ModelError, match="parsec"):
        fit(small, small.points, unit="parsec")
    with pytest.raises(ModelError, match="positive"):
        fit(small, small.points, unit=-1.0)
    with pytest.raises(ValueError, match="tables"):
        fit(small, small.points, tables="guess")  # type: ignore[arg-type]


def test_points_of_distances_have_these_distances(small: FaceModel) -> None:
    wanted = {"ES0": 69.0, "ENS0": 51.0, "MNS0": 30.0, "MW0": 50.0, "IRISD0": 14.0}
    points = points_of_distances(small, wanted)
    fapu = Fapu.measure(points)
    assert {f"{unit}0": fapu[unit] * 1024 for unit in ("ES", "ENS", "MNS", "MW", "IRISD")} == pytest.approx(
        wanted
    )
    fitted = fit(small, points)
    distance = fitted.fapu.MNS * 1024
    assert distance == pytest.approx(0.030, abs=1e-8)


@pytest.mark.parametrize(
    ("distances", "text"),
    [({"ES0": 0}, "ES0"), ({"ES0": 60, "XY": 3}, "XY"), ({"MW0": 50}, "needed"), ({"ES0": np.nan}, "ES0")],
)
def test_unusable_distances_are_refused(small: FaceModel, distances: dict[str, float], text: str) -> None:
    with pytest.raises(ModelError, match=text):
        points_of_distances(small, distances)


def test_the_real_files(head: FaceModel, shared: Path) -> None:
    """Candide's points, with all their mistakes, make a face; each mistake is told."""
    from fba.face.importers.points.fdp import read_fdp_points

    with warnings.catch_warnings(record=True, action="always") as told:
        given = read_fdp_points(shared / "data/candide/candide3.fdp")
        fitted = fit(head, given, tables="carry")
    text = " ".join(str(one.message) for one in told)
    assert "2.5 and 8.4 coincide" in text
    assert "pupil 3.5" in text
    size = np.ptp(fitted.points[[ROW["8.3"], ROW["8.4"]], 0]) / np.ptp(given[[ROW["8.3"], ROW["8.4"]], 0])
    kept = [ROW[name] for name in ("8.1", "8.2", "9.3", "9.1", "4.1", "4.6", "5.3", "11.3", "3.1", "3.12")]
    apart = np.linalg.norm(fitted.points[kept][:, None] - fitted.points[kept][None], axis=2)
    given_apart = np.linalg.norm(given[kept][:, None] - given[kept][None], axis=2) * size
    np.testing.assert_allclose(apart, given_apart, atol=2e-6)


def test_normals_turn_with_the_surface(small: FaceModel) -> None:
    fitted = fit(small, person(small, 16))
    for part in fitted.parts:
        assert part.normals is not None
        np.testing.assert_allclose(np.linalg.norm(part.normals, axis=1), 1.0, atol=1e-5)
        # the small head's normals were computed, so they must still be those of the surface
        cosine = (part.normals * vertex_normals(part.vertices, part.triangles)).sum(axis=1)
        assert cosine.min() > 0.999


def test_alignment_is_not_fooled_by_five_wild_points(small: FaceModel) -> None:
    given = small.points * 1000
    rng = np.random.default_rng(5)
    wild = rng.choice(84, 5, replace=False)
    given[wild] += rng.normal(scale=200, size=(5, 3))
    aligned = align(given, small.points)
    rest = np.delete(np.arange(84), wild)
    assert aligned.unit == "mm"
    np.testing.assert_allclose(aligned.points[rest], small.points[rest], atol=1e-4)


def test_stretches_of_a_linear_map() -> None:
    """A plate that is turned and pulled: its Jacobian in the plane, the mean stretch along the normal."""
    x, y = np.meshgrid(np.arange(5.0), np.arange(5.0))
    flat = np.column_stack([x.ravel(), y.ravel(), np.zeros(25)])
    cells = [5 * j + i for j in range(4) for i in range(4)]
    triangles = np.array([t for c in cells for t in ((c, c + 1, c + 6), (c, c + 6, c + 5))])
    part = Part("plate", "skin", flat, triangles)
    turn = rotation(3)
    found = surface_stretches(part, flat @ turn.T * 1.5)
    np.testing.assert_allclose(found, np.broadcast_to(1.5 * turn, (25, 3, 3)), atol=1e-5)


def test_turned_over_counts_flipped_triangles_only() -> None:
    x, y = np.meshgrid(np.arange(6.0), np.arange(6.0))
    flat = np.column_stack([x.ravel(), y.ravel(), np.zeros(36)])
    cells = [6 * j + i for j in range(5) for i in range(5)]
    triangles = np.array([t for c in cells for t in ((c, c + 1, c + 7), (c, c + 7, c + 6))])
    assert len(turned_over_triangles(flat, flat @ rotation(1).T, triangles)[0]) == 0
    bent = flat.copy()
    bent[14] += (1.4, 0.0, 0.0)  # over its right neighbour
    wrong, share = turned_over_triangles(flat, bent, triangles)
    corners = bent[triangles]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    assert sorted(wrong) == sorted(np.flatnonzero(area < 0))
    assert share == pytest.approx(len(wrong) / len(triangles))


def test_a_model_with_few_parts_can_be_fitted(small: FaceModel) -> None:
    """A skin alone, no eyes, no teeth, no tongue."""
    skin = small.part("skin")
    bound = np.where(small.bound < len(skin.vertices), small.bound, -1)
    bare = replace(small, parts=(skin,), bound=bound)
    given = person(bare, 17)
    fitted = fit(bare, given)
    np.testing.assert_allclose(fitted.points[bound >= 0], centred(given, bare)[bound >= 0], atol=1e-6)


def test_missing_points_of_the_model_stay_missing(small: FaceModel) -> None:
    points = small.points.copy()
    points[[ROW["10.1"], ROW["6.2"]]] = np.nan
    bound = np.where(np.isnan(points[:, 0]), -1, small.bound)
    lacking = replace(small, points=points, bound=bound)
    fitted = fit(lacking, person(small, 18))
    assert fitted.missing == ("6.2", "10.1")


def test_names_and_notes_are_kept(small: FaceModel) -> None:
    noted = replace(small, notes={"licence": "CC0"}, name="small")
    fitted = fit(noted, small.points * 1000)
    assert (fitted.name, fitted.notes["licence"]) == ("small", "CC0")
    assert "84 feature points" in fitted.notes["fitted"]
    assert fit(noted, small.points, name="Ada").name == "Ada"
    assert len(names()) == 84


def errors(findings: list[Finding]) -> list[str]:
    """Return the errors among findings."""
    return [str(finding) for finding in findings if finding.severity == "error"]


@pytest.fixture(scope="module")
def errors_of_head(head: FaceModel) -> list[str]:
    """What `check_faps` has against the head that is fitted."""
    from fba.face.checks import check_faps

    return errors(check_faps(head))


@pytest.mark.slow
@pytest.mark.parametrize("who", ["alice", "broad", "narrow and long"])
def test_every_faps_of_a_fitted_head_keeps_the_standard(
    head: FaceModel, errors_of_head: list[str], request: pytest.FixtureRequest, who: str
) -> None:
    """Of alice.fdp, and of people two standard deviations off the mean in face width or height."""
    from fba.face.checks import check_faps, check_neutral
    from fba.face.importers.points.fdp import read_fdp

    if who == "alice":
        alice = request.getfixturevalue("shared") / "data/xface/alice.fdp"
        given = points_of_distances(head, read_fdp(alice).distances)
    else:
        # Norms of adults: width 137 mm, sd 4.3; nasion to chin 121 mm, sd 6.0 (means of men and women).
        width, height = {"broad": (2, 0), "narrow and long": (-2, 2)}[who]
        given = head.points * (1 + width * 4.3 / 137, 1 + height * 6.0 / 121, 1.0) * 1000
    fitted = fit(head, given)
    assert errors(check_neutral(fitted)) == []
    found = errors(check_faps(fitted))
    assert len(found) <= len(errors_of_head), found
