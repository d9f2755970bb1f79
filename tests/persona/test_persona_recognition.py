"""Classes, components and networks; and what the trained default promises.

`python -m tools.persona.evaluation`: the table of docs/persona.md.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from fba.persona import ClassRecogniser
from fba.persona.points.layout import PARTS
from fba.persona.recognition import decide
from tools.persona import evaluation
from tools.persona.evaluation import WAYS, Evaluation, Row
from tools.persona.training import __main__ as training
from tools.persona.training.classes import class_faps, face_classes, part_classes
from tools.persona.training.examples import Examples, make_examples
from tools.persona.training.networks import (
    DIMENSIONS,
    UNITS,
    WANTED_ACCURACY,
    _loss,
    find_axes,
    train,
    train_component,
)


@pytest.fixture(scope="module")
def examples() -> Examples:
    return make_examples(5, 2, seed=4)


def test_the_rule_of_two_thresholds() -> None:
    classes = ("a", "b", "c")
    outputs = np.array([
        [0.09, 0.05, -1],  # below l1
        [0.11, -0.5, -1],
        [0.9, 0.53, -1],  # 0.53 < 0.6 x 0.9
        [0.9, 0.55, -1],
        [0.3, -1, 0.8],
    ])  # fmt: skip
    assert decide(outputs).names(classes) == ["", "a", "a", "a/b", "c"]
    assert decide(outputs[3:4], second=0.7).names(classes) == ["a"]


def test_35_classes_in_the_names_of_bosphorus() -> None:
    names = [one.name for one in face_classes()]
    assert len(names) == len(set(names)) == 35
    assert sum(name.startswith("E_") for name in names) == 6
    assert sum(name.startswith("LFAU_") for name in names) == 19
    faps = dict(zip(names, class_faps(), strict=True))
    assert not faps["NEUTRAL"].any()
    assert faps["LFAU_27"][2] > 900  # jaw
    assert faps["LFAU_12L"][11] > 400  # the left corner alone
    assert abs(faps["LFAU_12L"][12]) < 50
    assert (faps["UFAU_43"][[18, 19]] > 800).all()
    assert part_classes("left_brow") == ("NEUTRAL", "UFAU_1", "UFAU_4", "UFAU_2")


def test_slopes_of_the_error_are_right() -> None:
    random = np.random.default_rng(1)
    sizes, count = [3, 4, 2], 3 * 4 + 4 + 4 * 2 + 2
    inputs, wanted = random.normal(size=(7, 3)), np.sign(random.normal(size=(7, 2)))
    importance = random.uniform(0.1, 1, size=(7, 2))
    weights = random.normal(size=count)
    _, slope = _loss(weights, sizes, inputs, wanted, importance)
    measured = approx_fprime(weights, lambda one: _loss(one, sizes, inputs, wanted, importance)[0], 1e-7)
    np.testing.assert_allclose(slope, measured, atol=1e-5)


def test_a_network_learns_what_no_line_parts() -> None:
    random = np.random.default_rng(2)
    inputs = random.uniform(-1, 1, size=(200, 2))
    inside = (inputs[:, 0] * inputs[:, 1] > 0)[:, None]
    targets = np.concatenate([inside, ~inside], axis=1)
    found, again = (
        train(inputs[:150], targets[:150], inputs[150:], targets[150:], units=12, enough=0.85, tries=1)
        for _ in range(2)
    )
    np.testing.assert_array_equal(found.network.output, again.network.output)
    assert found.share > 0.85
    assert found.network.hidden.shape == (2, 12)


def test_components_are_those_of_the_worked_example() -> None:
    """Values of deviations 2 and 0.5, turned by -30 degrees: axes (0.866, -0.5) and (0.5, 0.866)."""
    random = np.random.default_rng(3)
    turn = np.array([[0.866, -0.5], [0.5, 0.866]])
    values = (random.normal(size=(4000, 2)) * (2, 0.5)) @ turn
    targets = np.ones((4000, 1), dtype=bool)
    check = np.arange(4000) % 5 == 0
    found = train_component("left_eye", ("a",), values, targets, check, tries=1)
    spread = values[~check].std(axis=0)
    first = found.axes[0] * np.sign(found.axes[0, 0])
    np.testing.assert_allclose(np.abs(first), np.sqrt(0.5), atol=1e-6)  # of two z-scores, always the diagonal
    shares, axes = find_axes(values)
    np.testing.assert_allclose(axes, [[0.866, -0.5], [0.5, 0.866]], atol=0.02)
    np.testing.assert_allclose(shares, [4 / 4.25, 0.25 / 4.25], atol=0.01)
    np.testing.assert_allclose(found.spread, spread)
    np.testing.assert_allclose(found.scores(values[:1]), ((values[:1] - found.mean) / spread) @ found.axes.T)


def test_training_writes_only_where_it_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def make_none(*_: object) -> Examples:
        raise AssertionError("it must not begin")

    monkeypatch.setattr("tools.persona.training.__main__.make_examples", make_none)
    for options, said in (([], "required: -o"), (["-o", str(tmp_path / "no" / "a")], "there is no folder")):
        monkeypatch.setattr("sys.argv", ["training", *options])
        with pytest.raises(SystemExit) as ended:
            training.main()
        assert ended.value.code == 2
        assert said in capsys.readouterr().err


def test_the_default_is_as_good_as_the_source_asks(tmp_path: Path) -> None:
    known = ClassRecogniser.default()
    for part in PARTS:
        component = known.components[part]
        assert component.share > WANTED_ACCURACY[part], part
        assert component.axes.shape[0] == DIMENSIONS[part] == {"mouth": 11}.get(part, 5)
        assert component.network.hidden.shape[1] == UNITS[part] == {"mouth": 30}.get(part, 20)
        np.testing.assert_allclose(component.axes @ component.axes.T, np.eye(len(component.axes)), atol=1e-5)
        assert component.variance.sum() == pytest.approx(1, abs=1e-5)
    assert known.components["mouth"].kept_variance > 0.93
    assert len(known.example_classes) == 40 * 35 * 2
    known.save(tmp_path / "copy")
    assert (tmp_path / "copy").stat().st_size < 2e6


def test_lips_that_push_forward_are_deep() -> None:
    """Depth, which no picture shows, is that of the nearest examples of the class."""
    known = ClassRecogniser.default()
    number = known.components["mouth"].classes.index("LFAU_18")
    pout = known.scores["mouth"][known.example_labels["mouth"][:, number]][:5]
    deep = known.find_depth(pout, np.full(5, number))
    assert deep[:, 29].min() > 2  # the middle of the upper lip, millimetres
    rest = known.find_depth(pout, np.zeros(5, dtype=np.intp))  # if it were NEUTRAL
    assert np.abs(rest[:, 29]).max() < 1


def test_examples_are_the_same_each_time(examples: Examples) -> None:
    again = make_examples(5, 2, seed=4)
    np.testing.assert_array_equal(examples.points, again.points)
    np.testing.assert_array_equal(examples.depth, again.depth)
    assert len(examples) == 5 * 2 * 35


def test_a_recogniser_comes_back_from_its_file(tmp_path: Path) -> None:
    known = ClassRecogniser.default()
    for name in ("one", "other"):
        known.save(tmp_path / name)
    assert (tmp_path / "one").read_bytes() == (tmp_path / "other").read_bytes()
    back = ClassRecogniser.load(tmp_path / "one")
    moved = np.random.default_rng(0).normal(size=(9, 54))
    one, other = (each.components["mouth"].outputs(moved) for each in (known, back))
    np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(back.depth, known.depth)


def test_examples_are_registered_faces_of_many_shapes(examples: Examples) -> None:
    rest = examples.neutral[:: 2 * 35]
    assert np.linalg.norm(rest - rest.mean(axis=0), axis=2).mean() > 0.4  # millimetres: persons differ
    classes = examples.classes == 0
    moved = (examples.points - examples.neutral)[classes]
    assert np.linalg.norm(moved, axis=2).mean() < 2  # heads that turn change a neutral face a little
    opened = examples.points[examples.classes == [one.name for one in face_classes()].index("LFAU_27")]
    assert (opened[:, 38, 1] - examples.neutral[0, 38, 1]).mean() < -8  # the lower lip goes down


def test_the_table_has_rows_of_contents_and_how_much_they_fall(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def few(**options: object) -> Evaluation:
        assert options == {"users": 1, "seed": 4}
        row = Row("E_HAPPY", 4.0, dict.fromkeys(WAYS, 2.0))
        faces = Row("E_HAPPY", 4.0, dict.fromkeys(WAYS, 1.0))
        means = dict.fromkeys(("motion", "curves", "masks"), 0.95)
        return Evaluation((row,), (faces,), means, {}, 0.7, 30, 10)

    monkeypatch.setattr(evaluation, "evaluate", few)
    evaluation.main(["--users", "1", "--seed", "4"])
    said = capsys.readouterr().out
    for text in ("E_HAPPY", "4.00", "2.00", "50.0 %", "75.0 %", "95.0 %", "0.70 mm"):
        assert text in said
    assert said.index("50.0 %") < said.index("75.0 %")  # of motion first, then with the faces at rest


@pytest.mark.parametrize("arguments", [["--users", "0"], ["--seed", "-1"]])
def test_numbers_out_of_range_are_refused(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        evaluation.main(arguments)
    assert ended.value.code == 2
    assert "--users must be at least 1, and --seed at least 0" in capsys.readouterr().err
