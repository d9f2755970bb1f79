"""The neutral face of the standard: what keeps its rules passes, and each rule is found when broken."""

from dataclasses import replace

import numpy as np
import pytest

from fba.face._tables import FaceDefMesh, FaceDefTables, FaceDefTransform
from fba.face.checks._findings import Finding
from fba.face.checks._neutral import check_locations, check_neutral
from fba.face.eyeball import eyeballs, pupil_diameter, sphere
from fba.face.feature_points import MIRRORED
from fba.face.model import FaceModel, Part
from fba.parameters import point_rows
from small_head import EYE_RADIUS, adult_points, ball, small_head

ROW = point_rows()


@pytest.fixture(scope="module")
def head() -> FaceModel:
    return small_head()


def moved(model: FaceModel, mm: dict[str, tuple[float, float, float]]) -> FaceModel:
    """The same model with feature points (not vertices) moved by so many millimetres."""
    points = np.array(model.points)
    for name, shift in mm.items():
        points[ROW[name]] += np.array(shift) / 1000
    return replace(model, points=points, bound=np.full(84, -1))


def finding_for(findings: list[Finding], subject: str, rule: str) -> Finding:
    hits = [one for one in findings if one.subject == subject and one.rule == rule]
    assert len(hits) == 1, [str(one) for one in findings]
    return hits[0]


def test_a_neutral_face_passes(head: FaceModel) -> None:
    assert check_neutral(head) == []


def test_the_units_of_length_do_not_matter_but_for_human_sizes(head: FaceModel) -> None:
    scaled = [
        replace(part, vertices=part.vertices * 100, normals=None, triangles=part.triangles)
        for part in head.parts
    ]
    findings = check_neutral(replace(head, parts=tuple(scaled), points=head.points * 100))
    assert {one.rule for one in findings} == {"size of a human face"}
    assert finding_for(findings, "ES0", "size of a human face").found.startswith("6200.0 mm")


@pytest.mark.parametrize(
    ("shift", "subject", "rule", "severity", "text"),
    [
        ({"2.3": (0, -1, 0)}, "feature points 2.2 and 2.3", "lips touch", "warning", "1.0 mm apart"),
        ({"2.3": (0, -3, 0)}, "feature points 2.2 and 2.3", "lips touch", "error", "3.0 mm apart"),
        ({"2.9": (0, 3, 0)}, "feature points 2.7 and 2.9", "lips touch", "error", "3.0 mm into each other"),
        (
            {"2.4": (0, -4, 0)},
            "feature point 2.4",
            "lips meet on a level line through the corners",
            "warning",
            "-4.0 mm",
        ),
        ({"9.11": (0, -2, 0)}, "feature points 9.10 and 9.11", "teeth touch", "warning", "2.0 mm apart"),
        ({"9.11": (0, -8, 0)}, "feature points 9.10 and 9.11", "teeth touch", "error", "8.0 mm apart"),
        ({"6.2": (0, 6, 0)}, "feature point 6.2", "tongue flat", "warning", "+6.0 mm"),
        (
            {"6.1": (0, -15, 0)},
            "feature point 6.1",
            "tip of the tongue where the teeth meet",
            "error",
            "-15.0 mm",
        ),
        (
            {"6.1": (0, 0, 6)},
            "feature point 6.1",
            "tip of the tongue at the teeth",
            "error",
            "-4.0 mm behind",
        ),
        ({"6.1": (0, 0, -12)}, "feature point 6.1", "tip of the tongue at the teeth", "warning", "14.0 mm"),
        ({"3.1": (0, 2, 0)}, "feature point 3.1", "lid tangent to the iris", "warning", "7.8 mm above"),
        ({"3.4": (0, 4.05, 0)}, "feature point 3.4", "lid tangent to the iris", "error", "1.8 mm below"),
        ({"3.5": (3, 0, 0)}, "left eye", "gaze along +z", "error", "14.0 degrees off"),
        ({"3.6": (0, 0.8, 0)}, "right eye", "gaze along +z", "warning", "3.8 degrees off"),
    ],
)
def test_a_broken_rule_is_found(
    head: FaceModel,
    shift: dict[str, tuple[float, float, float]],
    subject: str,
    rule: str,
    severity: str,
    text: str,
) -> None:
    finding = finding_for(check_neutral(moved(head, shift)), subject, rule)
    assert finding.severity == severity
    assert text in finding.found, finding


@pytest.mark.parametrize(
    ("shift", "subject", "rule", "severity"),
    [
        ({"2.6": (4, 0, 0)}, "feature point 2.6", "location: midway", "warning"),
        ({"8.6": (-4, 0, 0)}, "feature point 8.6", "location: midway", "warning"),
        ({"10.3": (0, 8, 0)}, "feature point 10.3", "location: midway", "warning"),
        ({"5.2": (0, 9, 0)}, "feature point 5.2", "location: level", "warning"),
        ({"5.4": (12, 0, 0)}, "feature point 5.4", "location: between", "warning"),
        ({"2.12": (12, 0, 0)}, "feature point 2.12", "location: between", "warning"),
        ({"11.2": (25, 0, 0)}, "feature point 11.2", "location: more", "warning"),
        ({"8.2": (0, -25, 0)}, "feature point 8.2", "location: more", "error"),
        ({"4.4": (0, -18, 0)}, "feature point 4.4", "location: more", "error"),
        ({"9.3": (0, 0, -20)}, "feature point 9.3", "location: more", "error"),
    ],
)
def test_a_misplaced_point_is_found(
    head: FaceModel, shift: dict[str, tuple[float, float, float]], subject: str, rule: str, severity: str
) -> None:
    findings = list(check_locations(moved(head, shift).points))
    assert finding_for(findings, subject, rule).severity == severity


def test_both_sides_have_the_same_rules(head: FaceModel) -> None:
    """The mirror image of a fault is found on the mirrored points."""
    mirror = {**MIRRORED, **{right: left for left, right in MIRRORED.items()}}
    for name in ROW:
        for axis in range(3):
            shift = np.zeros(3)
            shift[axis] = 15
            one = list(check_locations(moved(head, {name: tuple(shift)}).points))
            shift[0] *= -1
            other = list(check_locations(moved(head, {mirror.get(name, name): tuple(shift)}).points))

            def subjects(findings: list[Finding], swap: dict[str, str]) -> list[tuple[str, str, str]]:
                return sorted(
                    (" and ".join(sorted(swap.get(w, w) for w in one.subject.split() if w[0].isdigit())),
                     one.rule, one.severity)
                    for one in findings
                )  # fmt: skip

            assert subjects(one, {}) == subjects(other, mirror), (name, axis)


def test_sides_swapped_is_one_finding_a_pair(head: FaceModel) -> None:
    points = np.array(head.points)
    points[[ROW["9.1"], ROW["9.2"]]] = points[[ROW["9.2"], ROW["9.1"]]]
    findings = check_neutral(replace(head, points=points, bound=np.full(84, -1)))
    assert finding_for(findings, "9.1 and 9.2", "left and right").severity == "error"


def test_asymmetry_is_told_with_its_size(head: FaceModel) -> None:
    shift = dict.fromkeys(MIRRORED, (0.0, 4.0, 3.0))
    finding = finding_for(check_neutral(moved(head, shift)), "left and right", "symmetry")
    assert finding.severity == "warning"
    assert "5.0 mm on average" in finding.found
    assert [one for one in check_neutral(head) if one.rule == "symmetry"] == []


def test_a_child_is_human_a_giant_is_not(head: FaceModel) -> None:
    def scaled(factor: float) -> FaceModel:
        return replace(head, points=head.points * factor, bound=np.full(84, -1))

    rule = "size of a human face"
    assert [one for one in check_neutral(scaled(0.8)) if one.rule == rule] == []
    sizes = {one.subject: one for one in check_neutral(scaled(1.6)) if one.rule == rule}
    assert sizes["MW0"].found.startswith("83.2 mm")
    assert sizes["ES0"].severity == "warning"


def test_missing_points_are_named_and_not_checked(head: FaceModel) -> None:
    points = np.array(head.points)
    points[[ROW["6.1"], ROW["9.10"]]] = np.nan
    findings = check_neutral(
        replace(head, points=points, bound=np.where(np.isnan(points[:, 0]), -1, head.bound))
    )
    assert [one.rule for one in findings] == ["present"]
    assert "6.1, 9.10" in findings[0].found


def test_a_face_without_eyeballs_says_so(head: FaceModel) -> None:
    parts = tuple(part for part in head.parts if part.kind != "eye")
    findings = check_neutral(replace(head, parts=parts, bound=np.full(84, -1)))
    assert [one.subject for one in findings] == ["left eye", "right eye"]


def test_teeth_apart_as_meshes(head: FaceModel) -> None:
    lower = head.part("lower teeth")
    parts = tuple(
        replace(lower, vertices=lower.vertices - np.float32([0, 0.002, 0])) if part is lower else part
        for part in head.parts
    )
    findings = check_neutral(replace(head, parts=parts))
    assert "2.0 mm apart" in finding_for(findings, "parts upper teeth and lower teeth", "teeth touch").found


def test_an_egg_is_not_an_eyeball(head: FaceModel) -> None:
    eye = head.part("left eye")
    centre = adult_points()[ROW["3.5"]] - (0, 0, EYE_RADIUS)
    egg = replace(eye, vertices=(centre + (eye.vertices - centre) * (1.0, 1.3, 1.0)).astype(np.float32))
    parts = tuple(egg if part is eye else part for part in head.parts)
    findings = check_neutral(replace(head, parts=parts))
    assert finding_for(findings, "left eye", "eyeball is a sphere").severity == "warning"


@pytest.mark.parametrize(("pupil_mm", "severity"), [(3.9, None), (5.0, "warning"), (7.0, "error")])
@pytest.mark.parametrize("kind", ["mesh", "part"])
def test_the_pupil_is_a_third_of_the_iris(
    head: FaceModel, pupil_mm: float, severity: str | None, kind: str
) -> None:
    """The iris is 11.7 mm across, the pupil must be 3.9 mm; it is where dilate_pupil moves vertices most."""
    centre = adult_points()[ROW["3.5"]] - (0, 0, EYE_RADIUS)
    eye = head.part("left eye")
    vertices = np.array(eye.vertices, dtype=np.float64)
    turn = np.arange(12) * np.pi / 6
    radius = pupil_mm / 2000
    ring = np.stack([radius * np.cos(turn), radius * np.sin(turn), np.full(12, EYE_RADIUS)], axis=1)
    rim = centre + EYE_RADIUS * ring / np.linalg.norm(ring, axis=1, keepdims=True)
    rim[:, :2] = centre[:2] + ring[:, :2]
    if kind == "mesh":
        moves = np.zeros((13, 1, 3), dtype=np.float32)
        moves[1:, 0, :2] = 0.5 * ring[:, :2] / radius
        index = np.arange(len(vertices), len(vertices) + 12)
        changed = Part(eye.name, "eye", np.vstack([vertices, rim]), eye.triangles)
        table = FaceDefTables(29, (FaceDefMesh(eye.name, [-1000, 0], [5, *index], moves),))
        parts = tuple(changed if part is eye else part for part in head.parts)
    else:
        disc = Part("pupil", "other", rim, np.array([(0, i, i + 1) for i in range(1, 11)]))
        table = FaceDefTables(29, transforms=(FaceDefTransform("pupil", "scale", (1, 1, 0), tuple(centre)),))
        parts = (*head.parts, disc)
    bound = np.full(84, -1)
    model = replace(head, parts=parts, bound=bound, tables=(table,))
    measured = pupil_diameter(model, eyeballs(model)["left"])
    assert measured == pytest.approx(pupil_mm / 1000, rel=0.02)
    hits = [one for one in check_neutral(model) if one.rule == "pupil a third of the iris"]
    assert [one.severity for one in hits] == ([severity] if severity else [])


def test_the_sphere_is_found_under_a_cornea_and_a_flat_iris() -> None:
    centre, radius = np.array([0.03, 0.001, -0.012]), 0.0121
    vertices, triangles = ball(centre, radius, rings=24)
    front = vertices[:, 2] > centre[2] + 0.9 * radius
    vertices[front, 2] += 0.001
    fitted = sphere(Part("eye", "eye", vertices, triangles))
    np.testing.assert_allclose(fitted[0], centre, atol=2e-6)
    assert fitted[1] == pytest.approx(radius, abs=2e-6)
    assert fitted[2] < 1e-6


@pytest.mark.parametrize("count", [0, 5, 40])
def test_no_sphere_through_few_or_flat_vertices(count: int) -> None:
    vertices = np.random.default_rng(1).normal(size=(count, 3)) * (1, 1, 0)
    assert sphere(Part("eye", "eye", vertices, np.zeros((0, 3), dtype=int))) is None
