"""Body definition parameters: generic, calibrated and transmitted bodies.

The default skeleton, skeletons that must be refused, and BAPs of another convention by the standard's.
"""

import json
from pathlib import Path

import numpy as np
import pytest

import fba
from fba import BodyTrack
from fba.body import BapSolver, BodyDefinition, Skeleton
from fba.body.turned_legs import by_the_standard, find_turned_legs
from fba.errors import FbaError, ModelError
from fba.parameters import BAP_COUNT, bap_numbers

BODY = Skeleton.default()
LEG = ("l_hip", "l_knee", "l_ankle", "r_hip", "r_knee", "r_ankle")


def centres(scale: float = 1.0, *names: str) -> dict[str, list[float]]:
    return {name: (BODY.centres[BODY.number(name)] * scale).tolist() for name in names or BODY.names}


def distance(body: Skeleton, a: str, b: str) -> float:
    return float(np.linalg.norm(body.centres[body.number(a)] - body.centres[body.number(b)]))


def test_simple_ignores_what_was_sent() -> None:
    assert BodyDefinition(centres(2.0)).skeleton("simple") is BODY


def test_calibration_to_all_centres() -> None:
    np.testing.assert_allclose(BodyDefinition(centres(1.3)).skeleton().centres, BODY.centres * 1.3)


def test_calibration_to_its_own_centres_changes_nothing() -> None:
    for names in (LEG, ("skullbase",), ("l_shoulder", "l_wrist", "vt6"), ("HumanoidRoot", "skullbase")):
        found = BodyDefinition(centres(1.0, *names)).skeleton()
        np.testing.assert_allclose(found.centres, BODY.centres, atol=1e-9)


def test_calibration_to_a_larger_person_by_few_joints() -> None:
    found = BodyDefinition(centres(1.2, *LEG, "skullbase", "HumanoidRoot", "l_wrist", "r_wrist")).skeleton()
    for a, b in (
        ("l_shoulder", "l_elbow"),
        ("l_wrist", "l_middle1"),
        ("vt6", "vt5"),
        ("l_ankle", "l_subtalar"),
    ):
        assert distance(found, a, b) == pytest.approx(1.2 * distance(BODY, a, b), rel=0.02)


def test_longer_shanks_keep_the_arms() -> None:
    sent = centres(1.0, *LEG, "HumanoidRoot", "vt1", "l_elbow", "r_elbow")
    for name in ("l_ankle", "r_ankle"):
        sent[name] = [sent[name][0], sent[name][1] - 0.1, sent[name][2]]
    found = BodyDefinition(sent).skeleton()
    assert distance(found, "l_knee", "l_ankle") == pytest.approx(
        distance(BODY, "l_knee", "l_ankle") + 0.1, abs=0.01
    )
    assert distance(found, "l_shoulder", "l_elbow") == pytest.approx(distance(BODY, "l_shoulder", "l_elbow"))
    assert distance(found, "l_ankle", "l_metatarsal") > distance(BODY, "l_ankle", "l_metatarsal")
    solver = BapSolver(found)  # and it can be posed
    assert solver.pose(np.zeros(296)).shape == (87, 4, 4)


def test_predictable_takes_the_model_sent() -> None:
    sent = BodyDefinition(
        {"HumanoidRoot": (0, 1, 0), "l_hip": (0.1, 0.9, 0), "tail": (0, 1, -0.2)},
        {"tail": "HumanoidRoot", "l_hip": "HumanoidRoot", "HumanoidRoot": None},
    )
    body = sent.skeleton("predictable")
    assert set(body.names) == {"HumanoidRoot", "l_hip", "tail"}
    solver = BapSolver(body)
    assert "r_hip" in solver.missing
    with pytest.raises(ModelError, match="needs the parents"):
        BodyDefinition(centres()).skeleton("predictable")
    with pytest.raises(ModelError, match="no centre"):
        BodyDefinition({"a": (0, 0, 0)}, {"a": None, "b": "a"}).skeleton("predictable")
    with pytest.raises(ModelError, match="cycle"):
        BodyDefinition({"a": (0, 0, 0), "b": (0, 1, 0)}, {"a": "b", "b": "a"}).skeleton("predictable")


def test_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "body.json"
    joints = {"HumanoidRoot": {"centre": [0, 1.1, 0], "parent": None},
              "l_hip": {"centre": [0.1, 1.0, 0], "parent": "HumanoidRoot"}}  # fmt: skip
    path.write_text(json.dumps({"joints": joints}))
    found = BodyDefinition.load(path)
    assert found.skeleton("predictable").names == ("HumanoidRoot", "l_hip")
    assert found.skeleton("calibration").centres[BODY.number("l_hip"), 1] == 1.0
    for text in ("", "[]", "{}", '{"joints": []}', '{"joints": {"a": {"centre": [0, 1]}}}',
                 '{"joints": {"a": {"centre": [0, 1, NaN]}}}',
                 '{"joints": {"a": {"centre": [0, 1, 2], "parent": 3}}}',
                 '{"joints": {"a": {"centre": "abc"}}}', "[" * 100_000):  # fmt: skip
        path.write_text(text)
        with pytest.raises(FbaError):
            BodyDefinition.load(path)
    with pytest.raises(FbaError):
        BodyDefinition.load(tmp_path)


def test_wrong_profile_and_nothing_sent() -> None:
    with pytest.raises(ValueError, match="simple, calibration, predictable"):
        BodyDefinition({}).skeleton("other")
    assert BodyDefinition({}).skeleton("calibration") is BODY
    assert BodyDefinition({"tail": (0, 0, 0)}).skeleton("calibration") is BODY


def test_default_body_stands_on_its_feet() -> None:
    body = Skeleton.default()
    assert (len(body), body.names[0], body.parents[0]) == (87, "HumanoidRoot", -1)
    assert (body.parents[1:] < np.arange(1, 87)).all()
    left, right = body.centres[body.number("l_wrist")], body.centres[body.number("r_wrist")]
    assert left[0] > 0  # +x is the subject's left
    np.testing.assert_allclose(left * [-1, 1, 1], right)
    toe, ankle = body.centres[body.number("l_metatarsal")], body.centres[body.number("l_ankle")]
    assert toe[2] > ankle[2]  # +z is forward
    assert toe[1] < ankle[1] < body.centres[body.number("l_knee")][1] < body.centres[body.number("l_hip")][1]


@pytest.mark.parametrize(
    ("joint", "parent"),
    [
        ("l_hip", "sacroiliac"),
        ("vl5", "HumanoidRoot"),
        ("l_sternoclavicular", "vt1"),
        ("l_index0", "l_wrist"),
    ],
)
def test_hierarchy(joint: str, parent: str) -> None:
    body = Skeleton.default()
    assert body.names[body.parents[body.number(joint)]] == parent


def test_from_parents_takes_any_order() -> None:
    body = Skeleton.from_parents(
        {"b": "a", "HumanoidRoot": None, "a": "HumanoidRoot"},
        {"HumanoidRoot": (0, 1, 0), "a": (0, 2, 0), "b": (0, 4, 0)},
    )
    assert body.names == ("HumanoidRoot", "a", "b")
    np.testing.assert_allclose(body.offsets, [[0, 1, 0], [0, 1, 0], [0, 2, 0]])


@pytest.mark.parametrize(
    ("parents", "text"),
    [
        ({"r": None, "a": "b", "b": "a"}, "cycle"),
        ({"r": None, "a": "gone"}, "'gone'"),
        ({"r": None, "s": None}, "one root"),
        ({}, "joints"),
    ],
)
def test_impossible_hierarchies(parents: dict[str, str | None], text: str) -> None:
    with pytest.raises(ModelError, match=text):
        Skeleton.from_parents(parents, dict.fromkeys(parents, (0.0, 0.0, 0.0)))


def test_centres_must_be_finite_and_names_unique() -> None:
    with pytest.raises(ModelError, match="finite"):
        Skeleton(("r",), np.array([-1]), np.array([[0.0, np.nan, 0.0]]))
    with pytest.raises(ModelError, match="unique"):
        Skeleton(("r", "r"), np.array([-1, 0]), np.zeros((2, 3)))
    with pytest.raises(ModelError, match="root"):
        Skeleton(("r", "s"), np.array([1, 0]), np.zeros((2, 3)))


def bent(*degrees: float, knee: str = "l_knee_flexion") -> BodyTrack:
    """A body whose knee bends by these angles, frame by frame."""
    values = np.zeros((len(degrees), BAP_COUNT), dtype=np.int32)
    values[:, bap_numbers()[knee] - 1] = np.radians(degrees) * 1e5
    return BodyTrack(values, values != 0)


@pytest.mark.parametrize(
    ("body", "finding"),
    [
        (bent(0, 10, 30, 45), "knees bend forward in 2 of 4 frames, by up to 45 degrees"),
        (bent(30, knee="r_knee_flexion"), "in 1 of 1 frames"),
        (bent(30, 30, -30), "in 2 of 3 frames"),
        (bent(30, -30, -30), None),  # a jitter among knees that bend
        (bent(30, -30), None),
        (bent(0, 15, 19), None),  # stretched
        (bent(-45, -120), None),
        (bent(-30, 320, 315), None),  # past half a turn
        (bent(90, knee="l_hip_flexion"), None),
        (BodyTrack.empty(3), None),
        (BodyTrack.empty(0), None),
    ],
)
def test_knees_that_bend_forward(body: BodyTrack, finding: str | None) -> None:
    found = find_turned_legs(body)
    assert found is None if finding is None else finding in (found or "")


def test_of_the_files_of_others_one_is_found(shared: Path) -> None:
    found = [
        path.name
        for path in sorted((shared / "data" / "vreng").glob("*.bap"))
        if (body := fba.read(path).body) is not None and find_turned_legs(body)
    ]
    assert found == ["sit.bap"]


def test_bodies_by_the_standard_pose_alike() -> None:
    values = np.random.default_rng(1).integers(-60_000, 60_000, (5, BAP_COUNT), dtype=np.int32)
    body = BodyTrack(values, values > 0)
    turned = by_the_standard(body, "vreng")
    np.testing.assert_allclose(
        BapSolver().pose(turned.values), BapSolver(axes="vreng").pose(body.values), atol=1e-12
    )
    assert np.array_equal(turned.mask, body.mask)
    assert by_the_standard(turned, "vreng") == body
    assert by_the_standard(body, "iso") == body
    with pytest.raises(ValueError, match="more than signs"):
        by_the_standard(body, "abduct_first")
