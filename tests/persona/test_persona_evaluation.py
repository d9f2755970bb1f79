"""`python -m tools.persona.evaluation`: the table of docs/persona.md."""

import pytest

from tools.persona import evaluation
from tools.persona.evaluation import WAYS, Evaluation, Row


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
