"""Body definition parameters: generic, calibrated and transmitted bodies.

The default skeleton, and skeletons that must be refused.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from fba.body import BapSolver, BodyDefinition, Skeleton
from fba.errors import FbaError, ModelError

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
    assert len(body) == 87
    assert body.names[0] == "HumanoidRoot"
    assert body.parents[0] == -1
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
