"""The FIT: what it accepts, its node and JSON, and its values, worked out by hand."""

import copy
import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fba.errors import ModelError
from fba.face.interpolation._evaluate import evaluate
from fba.face.interpolation._node import Function, Link, Term
from fba.face.interpolation.table import InterpolationTable
from fba.parameters import fap_numbers, faps

SURPRISE = 6


def one(name: str, coefficient: float = 1.0) -> Function:
    """coefficient x the number."""
    return Function([Term(coefficient, {name: 1})])


def worked_example() -> InterpolationTable:
    """FAP 6 = (F3 + 2 F4 + 3 F5 + 4 F4 F5^2) / (5 F5 + 6 F3 F4 F5), FAP 7 = F4, and FAPs 12 and 17 in
    proportion to the intensity of surprise, in whichever place it stands."""

    def surprise(coefficient: float) -> Function:
        return Function(
            [
                Term(coefficient, {f"expression_intensity{i}": 1}, (f"expression_select{i}", SURPRISE))
                for i in (1, 2)
            ]
        )

    jaw, upper, lower = names = ("open_jaw", "lower_t_midlip", "raise_b_midlip")
    corner = Function(
        [Term(1, {jaw: 1}), Term(2, {upper: 1}), Term(3, {lower: 1}), Term(4, {upper: 1, lower: 2})],
        [Term(5, {lower: 1}), Term(6, {jaw: 1, upper: 1, lower: 1})],
    )
    return InterpolationTable(
        [
            Link(names, {"stretch_l_cornerlip": corner, "stretch_r_cornerlip": one(upper)}),
            Link(("expression",), {"raise_l_cornerlip": surprise(0.6), "push_t_lip": surprise(-1.5)}),
        ]
    )


NODE: dict[str, list[Any]] = {
    "FAPs": [3, 4, 5, -1, 6, 7, -1, 2, -1, 12, 17, -1],
    "Graph": [1, 2, 3, 4],
    "numeratorTerms": [4, 1, 2, 2],
    "denominatorTerms": [2, 0, 0, 0],
    "numeratorExp": [1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 2, 0, 1, 0, *[0, 1, 0, 0, 0, 0, 0, 1] * 2],
    "denominatorExp": [0, 0, 1, 1, 1, 1],
    "numeratorImpulse": [1, 6, 3, 6, 1, 6, 3, 6],
    "numeratorCoefs": [1.0, 2.0, 3.0, 4.0, 1.0, 0.6, 0.6, -1.5, -1.5],
    "denominatorCoefs": [5.0, 6.0],
}


def values_of(
    table: InterpolationTable,
    sent: dict[str, float],
    expression: tuple[int, ...] | None = None,
    viseme: tuple[int, ...] | None = None,
) -> dict[str, float]:
    """What a table makes of one frame: FAPs that it fills, by name."""
    values, known = np.zeros((1, 68)), np.zeros((1, 68), dtype=bool)
    for name, value in sent.items():
        values[0, fap_numbers()[name] - 1], known[0, fap_numbers()[name] - 1] = value, True
    known[0, :2] = viseme is not None, expression is not None
    fields = [
        np.array([given or (0,) * size], dtype=np.int16) for given, size in ((viseme, 4), (expression, 6))
    ]
    filled, now, _ = evaluate(table, values, known, fields[0], fields[1])
    new = now & ~known
    assert np.isfinite(filled).all()
    return {faps()[c].name: float(filled[0, c]) for c in np.flatnonzero(new[0])}


# ---- values


def test_the_rational_functions_by_hand() -> None:
    # (2 + 2 x 3 + 3 x 5 + 4 x 3 x 25) / (5 x 5 + 6 x 2 x 3 x 5) = 323 / 205
    found = values_of(worked_example(), {"open_jaw": 2, "lower_t_midlip": 3, "raise_b_midlip": 5})
    assert found == pytest.approx({"stretch_l_cornerlip": 323 / 205, "stretch_r_cornerlip": 3})


@pytest.mark.parametrize(
    ("expression", "amount"),
    [
        ((6, 40, 1, 20, 0, 0), 40),
        ((1, 40, 6, 20, 0, 0), 20),
        ((6, 40, 6, 20, 0, 0), 60),
        ((1, 9, 2, 9, 0, 0), 0),
    ],
)
def test_impulses_select_the_expression(expression: tuple[int, ...], amount: int) -> None:
    found = values_of(worked_example(), {}, expression)
    assert found == pytest.approx({"raise_l_cornerlip": 0.6 * amount, "push_t_lip": -1.5 * amount})


def test_impulses_select_the_viseme() -> None:
    terms = [Term(2, {"viseme_blend": 1, "open_jaw": 1}, ("viseme_select1", 14)), Term(1)]
    table = InterpolationTable([Link(("viseme", "open_jaw"), {"push_b_lip": Function(terms)})])
    assert values_of(table, {"open_jaw": 10}, viseme=(14, 0, 63, 0)) == {"push_b_lip": 2 * 63 * 10 + 1}
    assert values_of(table, {"open_jaw": 10}, viseme=(13, 14, 63, 0)) == {"push_b_lip": 1}
    assert values_of(table, {"open_jaw": 10}) == {}  # no viseme in force


def test_links_are_tried_in_their_order() -> None:
    table = InterpolationTable(
        [
            Link(("push_b_lip", "push_t_lip"), {"open_jaw": one("push_t_lip", 10)}),
            Link(("push_b_lip",), {"open_jaw": one("push_b_lip", 100)}),
        ]
    )
    assert values_of(table, {"push_b_lip": 1, "push_t_lip": 1}) == {"open_jaw": 10}
    assert values_of(table, {"push_b_lip": 1}) == {"open_jaw": 100}
    assert values_of(table, {"push_t_lip": 1}) == {}


def test_interpolated_faps_serve_further_links_whatever_the_order() -> None:
    chain = [
        Link(("raise_b_midlip",), {"open_jaw": one("raise_b_midlip", 3)}),
        Link(("lower_t_midlip",), {"raise_b_midlip": one("lower_t_midlip", 2)}),
    ]
    expected = {"raise_b_midlip": 14, "open_jaw": 42}
    for links in (chain, chain[::-1]):
        assert values_of(InterpolationTable(links), {"lower_t_midlip": 7}) == expected


def test_what_was_sent_stays_though_others_of_its_set_are_filled() -> None:
    found = values_of(
        worked_example(),
        {"open_jaw": 2, "lower_t_midlip": 3, "raise_b_midlip": 5, "stretch_r_cornerlip": -9},
    )
    assert found == pytest.approx({"stretch_l_cornerlip": 323 / 205})


def test_exponents_from_0_to_15() -> None:
    table = InterpolationTable(
        [Link(("open_jaw",), {"depress_chin": Function([Term(-0.5, {"open_jaw": 15}), Term(3)])})]
    )
    assert values_of(table, {"open_jaw": 2}) == {"depress_chin": 3 - 2**14}
    assert values_of(table, {"open_jaw": -2}) == {"depress_chin": 3 + 2**14}
    assert values_of(table, {"open_jaw": 0}) == {"depress_chin": 3}


def test_an_empty_numerator_is_zero_and_an_empty_denominator_one() -> None:
    nothing = InterpolationTable([Link(("open_jaw",), {"depress_chin": Function()})])
    assert values_of(nothing, {"open_jaw": 55}) == {"depress_chin": 0}


@pytest.mark.parametrize(
    "function",
    [
        Function([Term(1)], [Term(1, {"open_jaw": 1})]),  # 1 / 0
        Function([Term(1, {"open_jaw": 1})], [Term(1, {"open_jaw": 1})]),  # 0 / 0
        Function([Term(1e308), Term(1e308)]),  # infinite
        Function([Term(1e308), Term(1e308)], [Term(1e308), Term(1e308)]),  # infinite / infinite
        Function([Term(2.0**31)]),  # no 32-bit integer
        Function([Term(1)], [Term(5e-324)]),
    ],
)
def test_a_link_without_a_value_leaves_the_fap_to_the_next(function: Function) -> None:
    first = Link(("open_jaw",), {"depress_chin": function})
    assert values_of(InterpolationTable([first]), {"open_jaw": 0}) == {}
    second = Link(("open_jaw",), {"depress_chin": Function([Term(8)])})
    assert values_of(InterpolationTable([first, second]), {"open_jaw": 0}) == {"depress_chin": 8}


def test_a_denominator_may_vanish_in_single_frames() -> None:
    table = InterpolationTable(
        [Link(("open_jaw",), {"depress_chin": Function([Term(12)], [Term(1, {"open_jaw": 1})])})]
    )
    values, known = np.zeros((3, 68), dtype=np.int32), np.zeros((3, 68), dtype=bool)
    values[:, 2], known[:, 2] = (3, 0, -4), True
    none = np.zeros((3, 6), dtype=np.int16)
    filled, now, _ = evaluate(table, values, known, none[:, :4], none)
    assert filled[:, 17].tolist() == [4, 0, -3]
    assert now[:, 17].tolist() == [True, False, True]


# ---- node and JSON


def test_the_node_has_the_standards_lists() -> None:
    node = worked_example().to_node()
    assert node == NODE
    assert InterpolationTable.from_node(NODE) == worked_example()


def test_a_graph_that_counts_from_zero_is_understood() -> None:
    assert InterpolationTable.from_node({**NODE, "Graph": [0, 1, 2, 3]}) == worked_example()


def test_a_term_of_the_expression_may_count_always() -> None:
    node = {**NODE, "numeratorImpulse": [0, 0, 3, 6, 1, 6, 3, 6]}
    found = values_of(InterpolationTable.from_node(node), {}, (1, 40, 2, 20, 0, 0))
    assert found == pytest.approx({"raise_l_cornerlip": 0.6 * 40, "push_t_lip": 0})


def test_equal_sets_are_listed_once() -> None:
    table = InterpolationTable(
        [Link(("open_jaw",), {name: one("open_jaw")}) for name in ("push_b_lip", "push_t_lip")]
    )
    node = table.to_node()
    assert (node["FAPs"], node["Graph"]) == ([3, -1, 16, -1, 17, -1], [1, 2, 1, 3])


def test_a_table_survives_json() -> None:
    table = worked_example()
    data = json.loads(json.dumps(table.to_dict()))
    assert InterpolationTable.from_dict(data) == table
    destination = data["links"][1]["destination"]["push_t_lip"]
    assert destination["numerator"][1] == {
        "coefficient": -1.5,
        "powers": {"expression_intensity2": 1},
        "when": {"expression_select2": 6},
    }
    for function in data["links"][0]["destination"].values():
        function.pop("denominator")
    assert InterpolationTable.from_dict(data) != table


def test_an_empty_table_does_nothing() -> None:
    table = InterpolationTable([])
    assert InterpolationTable.from_node(table.to_node()) == table
    assert InterpolationTable.from_dict(table.to_dict()) == table
    assert values_of(table, {"open_jaw": 1}, (1, 63, 0, 0, 0, 0)) == {}


# ---- refusals

LOOP = [
    Link(("open_jaw",), {"raise_l_cornerlip": one("open_jaw")}),
    Link(("raise_l_cornerlip",), {"lower_t_midlip": one("raise_l_cornerlip")}),
    Link(("lower_t_midlip",), {"open_jaw": one("lower_t_midlip")}),
]


def test_a_circle_is_refused_and_named() -> None:
    assert InterpolationTable(LOOP[:2]).order == (12, 4)
    with pytest.raises(ModelError, match="open_jaw -> raise_l_cornerlip -> lower_t_midlip -> open_jaw"):
        InterpolationTable(LOOP)
    with pytest.raises(ModelError, match="circle: open_jaw -> open_jaw"):
        InterpolationTable([Link(("open_jaw", "push_b_lip"), {"open_jaw": one("push_b_lip")})])


@pytest.mark.parametrize(
    ("link", "message"),
    [
        (Link((), {"open_jaw": Function()}), "link 1 .* source set is empty"),
        (Link(("open_jaw",), {}), "link 1 .* destination set is empty"),
        (Link(("open_mouth",), {"open_jaw": Function()}), "'open_mouth', which is no FAP"),
        (Link(("push_b_lip",) * 2, {"open_jaw": Function()}), "push_b_lip twice"),
        (Link(("open_jaw",), {"viseme": Function()}), r"viseme cannot be interpolated, only FAPs 3\.\.68"),
        (Link(("open_jaw",), {"expression": Function()}), "expression cannot be interpolated"),
        (Link(("open_jaw",), {"push_b_lip": Function([Term(math.nan)])}), "nan is not a finite number"),
        (Link(("open_jaw",), {"push_b_lip": Function([Term(math.inf)])}), "inf is not a finite number"),
        (Link(("open_jaw",), {"push_b_lip": Function([], [Term(10**400)])}), "not a finite number"),
        (Link(("open_jaw",), {"push_b_lip": Function([Term()] * 11)}), "11 terms, but there may be 10"),
        (Link(("open_jaw",), {"push_b_lip": one("push_t_lip")}), "'push_t_lip' is not in the source set"),
        (
            Link(("open_jaw",), {"push_b_lip": Function([Term(1, {"open_jaw": 16})])}),
            r"term 1: the exponent of open_jaw must be a whole number 0\.\.15, not 16",
        ),
        (Link(("open_jaw",), {"push_b_lip": Function([Term(1, {"open_jaw": -1})])}), "not -1"),
        (
            Link(("open_jaw",), {"push_b_lip": Function([Term(1, {}, ("expression_select1", 1))])}),
            "no select of the source set",
        ),
        (
            Link(("expression",), {"push_b_lip": Function([Term(1, {}, ("expression_intensity1", 1))])}),
            "no select of the source set",
        ),
        (
            Link(("expression",), {"push_b_lip": Function([Term(1, {}, ("expression_select1", 7))])}),
            r"expression_select1 = 7, which must be 0\.\.6",
        ),
        (
            Link(("viseme",), {"push_b_lip": Function([Term()], [Term(1, {}, ("viseme_select1", 7))])}),
            "only a numerator may have an impulse",
        ),
    ],
)
def test_bad_links_are_refused(link: Link, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        InterpolationTable([link])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"FAPs": [3, 4, 5, -1, 6, 7, -1, 2, -1, 12, 17]}, "set 4 is not ended by -1"),
        ({"FAPs": [3, 4, 5, -1, -1, 6, 7, -1, 2, -1, 12, 17, -1]}, "set 2 is empty"),
        ({"FAPs": [3, 4, 0, -1, 6, 7, -1, 2, -1, 12, 17, -1]}, "set 1 names FAP 0"),
        ({"FAPs": [3, 4, 69, -1]}, r"FAPs of the FIT: number 3 is 69, which must be a whole number -1\.\.68"),
        ({"FAPs": [3, 4, 5, -1, 6, 6, -1, 2, -1, 12, 17, -1]}, "stretch_l_cornerlip twice"),
        ({"FAPs": [3, 4, 5, -1, 6, 7, -1, 2, -1, 12, 1, -1]}, "viseme cannot be interpolated"),
        ({"Graph": [1, 2, 3]}, "3 numbers; it must be pairs"),
        ({"Graph": [1, 2, 3, 5]}, "asks for set 5, but FAPs lists 4"),
        ({"Graph": [1, 2]}, "more than its links need"),
        ({"Graph": [1.5, 2]}, "whole number"),
        ({"numeratorTerms": [4, 1, 2]}, "numeratorTerms of the FIT ends after 3 numbers"),
        ({"numeratorTerms": [11, 1, 2, 2]}, r"whole number 0\.\.10"),
        ({"numeratorExp": [16]}, r"whole number 0\.\.15"),
        ({"denominatorExp": [0, 0, 1, 1, 1]}, "denominatorExp of the FIT ends after 5 numbers"),
        ({"denominatorCoefs": [5.0, math.nan]}, "number 2 is nan, which must be finite"),
        ({"numeratorCoefs": []}, "numeratorCoefs of the FIT ends"),
        ({"numeratorImpulse": [1, 6, 3, 6]}, "numeratorImpulse of the FIT ends"),
        ({"numeratorImpulse": [5, 6, 3, 6, 1, 6, 3, 6]}, r"\(5, 6\) does not name one of the 4 numbers"),
        ({"numeratorImpulse": [2, 6, 3, 6, 1, 6, 3, 6]}, "no select of the source set"),
        ({"numeratorImpulse": [1, 7, 3, 6, 1, 6, 3, 6]}, r"must be 0\.\.6"),
        ({"numeratorimpulse": [1]}, "no field 'numeratorimpulse'"),
        ({"Graph": None}, "Graph of the FIT must be a list of numbers"),
        ({"Graph": [1, "2"]}, "number 2 is '2', which must be a whole number"),
        ({"numeratorCoefs": [10**400]}, "which must be finite"),
    ],
)
def test_bad_nodes_are_refused(change: dict[str, list[Any]], message: str) -> None:
    with pytest.raises(ModelError, match=message):
        InterpolationTable.from_node({**NODE, **change})


def _with_terms(numerator: list[Any]) -> Any:
    """The worked example with other terms for the upper lip."""
    data = copy.deepcopy(worked_example().to_dict())
    data["links"][1]["destination"]["push_t_lip"]["numerator"] = numerator
    return data


def _with_term(**changes: Any) -> Any:
    terms = worked_example().to_dict()["links"][1]["destination"]["push_t_lip"]["numerator"]
    return _with_terms([{**terms[0], **changes}, *terms[1:]])


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (None, "the FIT must be an object"),
        ([], "the FIT must be an object"),
        ({}, "the links of the FIT must be a list"),
        ({"links": [], "more": 1}, "'more' is unknown here"),
        ({"links": [{"source": "viseme", "destination": {}}]}, "link 1 of the FIT: source must be a list"),
        ({"links": [{"source": [3], "destination": {}}]}, "list of names"),
        ({"links": [{"source": ["open_jaw"], "destination": []}]}, "destination must be an object"),
        (_with_terms([5]), "term 1 must be"),
        (_with_terms([{}]), "term 1 has no coefficient"),
        (_with_terms([{"coefficient": "1"}]), "not a finite number"),
        (_with_terms([{"coefficient": True}]), "not a finite number"),
        (_with_term(when={}), None),
        (_with_term(when={"expression_select1": 1, "expression_select2": 1}), "when must name one select"),
        (_with_term(powers={"expression_intensity1": 1.5}), "whole number"),
    ],
)
def test_bad_json_is_refused(data: object, message: str | None) -> None:
    if message is None:
        InterpolationTable.from_dict(data)
        return
    with pytest.raises(ModelError, match=message):
        InterpolationTable.from_dict(data)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.sampled_from(["open_jaw", "viseme", ""]),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(
                ["links", "source", "destination", "open_jaw", "numerator", "coefficient", "powers", "when"]
            ),
            inner,
            max_size=4,
        )
    ),
    max_leaves=20,
)


@given(JSON)
@settings(max_examples=200)
def test_any_json_is_read_or_refused(data: object) -> None:
    try:
        table = InterpolationTable.from_dict(data)
    except ModelError:
        return
    assert InterpolationTable.from_dict(table.to_dict()) == table


@given(st.data())
@settings(max_examples=150)
def test_any_node_is_read_or_refused(data: st.DataObject) -> None:
    node = copy.deepcopy(NODE)
    for _ in range(data.draw(st.integers(1, 3))):
        field = node[data.draw(st.sampled_from(sorted(node)))]
        place = data.draw(st.integers(0, max(len(field) - 1, 0)))
        number = data.draw(st.integers(-3, 70) | st.floats() | st.just(10**400) | st.none())
        if field and data.draw(st.booleans()):
            field[place] = number
        elif field and data.draw(st.booleans()):
            del field[place]
        else:
            field.insert(place, number)
    try:
        table = InterpolationTable.from_node(node)
    except ModelError:
        return
    again = InterpolationTable.from_node(table.to_node())
    assert again == table
    values_of(again, {"open_jaw": 3, "lower_t_midlip": -4, "raise_b_midlip": 1860}, (6, 63, 1, 9, 0, 0))
