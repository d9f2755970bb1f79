"""How a stream's table of BAP steps is chosen: by its mark, else by the way it moves, else the standard's."""

import json
import warnings
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import fba
from fba import Animation, BodyTrack, EncoderOptions
from fba.body.plausibility import find_doubt
from fba.formats import step_choice
from fba.formats.step_choice import LIKELY, UNSURE, StepChoice, choose_steps
from fba.parameters import bap_numbers
from made_streams import made_streams

UNTOLD = {"real/perfumist_basicMotion.fba"}
"""The foreign stream in the other table in which nothing shows that: arms and fingers move less."""


def test_made_streams() -> None:
    """The first 16 of those of which `python tests/helpers/made_streams.py 500` tries more."""
    seen = set()
    for made in made_streams(16):
        assert choose_steps(made.marked) == StepChoice(made.table, "the stream says so")
        choice = choose_steps(made.unmarked)
        assert choice.table == made.table or choice.confidence == UNSURE, made.kind
        seen.add((made.table, choice.table))
    assert seen == {("iso", "iso"), ("visage", "visage"), ("visage", "iso")}


def test_foreign_streams(shared: Path) -> None:
    """Of 177, 70 have a body. None of the standard' is taken for another; one other cannot be told."""
    folder, wrong, checked = shared / "vectors", set(), 0
    for record in json.loads((folder / "index.json").read_text(encoding="utf-8")):
        if "decoded_bap" not in record:
            continue
        data, right = (folder / record["stream"]).read_bytes(), record["bap_steps"]
        checked += 1
        chosen = choose_steps(data).table
        if chosen != right:
            with warnings.catch_warnings(action="ignore", category=fba.FbaWarning):
                if fba.decode(data, bap_steps=chosen) != fba.decode(data, bap_steps=right):
                    wrong.add(record["stream"])
    assert (checked, wrong) == (70, UNTOLD)


def keyed(degrees: list[float], quant: int = 1) -> bytes:
    """Both elbows go straight from key to key, half a second each, in the steps of "visage"."""
    times = np.arange(15 * (len(degrees) - 1) + 1) / 15
    values = np.zeros((len(times), 296), dtype=np.int32)
    values[:, [37, 38]] = np.rint(np.radians(np.interp(times, range(len(degrees)), degrees)) * 1e5)[:, None]
    body = BodyTrack(values, values.any(axis=0) | np.zeros((len(times), 1), bool))
    options = EncoderOptions(bap_steps="visage", bap_quant=quant, mark=False)
    return fba.encode(Animation(30, range(len(times)), None, body), options)  # type: ignore[arg-type]


def test_round_angles_tell_the_table() -> None:
    assert choose_steps(keyed([0, 90, 35, 60, 5, 75])) == StepChoice(
        "visage",
        "the stream does not say, and with iso angles are odd that visage makes multiples of 5 degrees",
        LIKELY,
    )
    assert choose_steps(keyed([0, 88, 33, 61, 7, 73])).table == "iso"


def test_every_key_is_round() -> None:
    """By chance, one of 28 single keys would be. Keys of 60 degrees are as round in either table here."""
    assert choose_steps(keyed([0, 90])).table == "visage"
    assert choose_steps(keyed([0, 88])).table == "iso"
    assert choose_steps(keyed([0, 90, 33])).table == "iso"


def test_angles_may_be_round_in_radians() -> None:
    """0.7 rad are 40.1 degrees, 1.3 rad 74.5, 0.2 rad 11.5."""
    chosen = choose_steps(keyed(np.degrees([0, 0.7, 1.3, 0.2]).tolist()))
    assert chosen.table == "visage"
    assert chosen.reason.endswith("with iso angles are odd that visage makes multiples of 0.1 rad")


def test_of_coarse_quantisers_only_what_they_do_not_explain_counts() -> None:
    """With bap_quant 4, steps are 5 times as long: 0.49 degrees, and 0.18 with the other table."""
    rng = np.random.default_rng(1)
    five = keyed((5.0 * rng.permutation(30)).tolist(), quant=4)
    assert choose_steps(five).table == "visage"
    assert choose_steps(keyed(rng.uniform(0, 145, 30).tolist(), quant=4)).confidence == UNSURE


def swaying(millimetres: float, *, legs: float = 0.0, seconds: float = 4.0, steps: str = "visage") -> bytes:
    """A body that sways sideways, one way and back in `seconds`, while its hips swing by `legs` degrees."""
    wave = np.sin(2 * np.pi * np.arange(121) / 30 / seconds)
    values = np.zeros((121, 296), dtype=np.int32)
    values[:, bap_numbers()["HumanoidRoot_tr_lateral"] - 1] = np.rint(millimetres * wave)
    values[:, [bap_numbers()[f"{side}_hip_flexion"] - 1 for side in "lr"]] = np.rint(
        np.radians(legs * wave)[:, None] * 1e5
    )
    body = BodyTrack(values, np.broadcast_to(values.any(axis=0), values.shape))
    return fba.encode(Animation(30, range(121), None, body), EncoderOptions(bap_steps=steps, mark=False))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("sway", "told"),
    [
        (swaying(6), True),  # 3 steps each way: 192 mm on legs that rest
        (swaying(2.5), False),  # 1 step each way, as rounding may move a root that stands
        (swaying(6, legs=4), False),  # the feet move by 6 cm against the root
        (swaying(6, seconds=8), True),
        (swaying(6, seconds=16), False),  # glides one way
    ],
)
def test_who_stands_does_not_slide_to_and_fro(sway: bytes, told: bool) -> None:
    chosen = choose_steps(sway)
    assert ("slides" in chosen.reason) == told
    assert (chosen.table, chosen.confidence) == (("visage", LIKELY) if told else ("iso", UNSURE))


@pytest.mark.parametrize("sway", [50, 100, 190])
def test_who_sways_by_the_standards_steps_is_not_doubted(sway: float) -> None:
    assert choose_steps(swaying(sway, legs=sway / 15, steps="iso")).table == "iso"


@pytest.mark.parametrize(("metres", "told"), [(0.5, False), (0.74, False), (0.8, True), (3.0, True)])
def test_nobody_stands_far_from_the_origin(metres: float, told: bool) -> None:
    """32 times as far with the other table: 24 m, 26 m."""
    values = np.zeros((40, 296), dtype=np.int32)
    values[:, bap_numbers()["HumanoidRoot_tr_frontal"] - 1] = int(metres * 1000)
    body = BodyTrack(values, values != 0)
    chosen = choose_steps(
        fba.encode(Animation(30, range(40), None, body), EncoderOptions(bap_steps="visage", mark=False))
    )  # type: ignore[arg-type]
    assert (chosen.table == "visage") == told


def turning(head: float, *, amount: float = 0.1, still: bool = True) -> Animation:
    """A body that turns by +-amount rad, and whose neck turns back `head` times as far. still: it stays."""
    sway = np.sin(np.arange(90) / 9.0)
    values = np.zeros((90, 296), dtype=np.int32)
    values[:, bap_numbers()["HumanoidRoot_rt_body_turn"] - 1] = np.rint(1e5 * amount * sway)
    values[:, bap_numbers()["vc7_torsion"] - 1] = np.rint(-1e5 * amount * head * sway)
    if not still:
        values[:, bap_numbers()["HumanoidRoot_tr_lateral"] - 1] = np.rint(150 * sway)
    body = BodyTrack(values, np.broadcast_to(values.any(axis=0), values.shape))
    return Animation(30, range(90), None, body)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("animation", "told"),
    [
        (turning(1.0), True),  # 2.7 times with the other table, which has vc7 in the same steps
        (turning(0.72), True),
        (turning(0.63), False),
        (turning(0.35), False),
        (turning(-1.0), False),
        (turning(1.9), False),
        (turning(1.0, amount=0.01), False),
        (turning(1.0, amount=0.5), False),
        (turning(1.0, still=False), False),
    ],
)
def test_a_head_turns_back_as_far_as_the_body_turns(animation: Animation, told: bool) -> None:
    chosen = choose_steps(fba.encode(animation, EncoderOptions(bap_steps="visage", mark=False)))
    assert ("the head turns back" in chosen.reason) == told
    assert chosen.table == ("visage" if told else "iso")


@pytest.mark.parametrize("head", [-1.0, 0.0, 0.4, 0.8, 1.2, 1.7])
def test_a_head_that_turns_back_as_people_do_is_not_doubted(head: float) -> None:
    assert choose_steps(fba.encode(turning(head), EncoderOptions(bap_steps="iso", mark=False))).table == "iso"


def test_coarse_quantisers_make_round_angles_of_their_own() -> None:
    """Multiples of 154 steps are whole fifteens of degrees with the other table, by the quantiser alone."""
    values = np.zeros((40, 296), dtype=np.int32)
    values[:, 31:35] = 64 * 154 * np.random.default_rng(3).integers(0, 5, (40, 4))
    assert find_doubt(BodyTrack(values, values != 0), np.arange(40), Fraction(50), "iso") is None
    values[5, 31] += 64  # not that of the quantiser
    found = find_doubt(BodyTrack(values, values != 0), np.arange(40), Fraction(50), "iso")
    assert found.likely == "visage"


def test_nothing_is_said_where_the_table_makes_no_difference() -> None:
    body = BodyTrack(np.ones((2, 296), np.int32), np.ones((2, 296), bool))
    unquantised = fba.encode(Animation(30, range(2), None, body), EncoderOptions(bap_quant=0, mark=False))  # type: ignore[arg-type]
    for data in (unquantised, b"", b"no stream at all"):
        assert choose_steps(data) == StepChoice("iso", "")


def test_only_the_beginning_is_decoded_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    data = keyed([0, 90, 35, 60, 5, 75])
    monkeypatch.setattr(step_choice, "FRAMES_CHECKED", 5)
    monkeypatch.setattr(step_choice, "CHUNK_BYTES", 64)
    found = step_choice.first_frames(data, "iso")
    assert 5 <= len(found) < 40
    monkeypatch.setattr(step_choice, "FRAMES_SEARCHED", 0)
    assert step_choice.first_frames(data, "iso") is None


def test_read_chooses_only_when_asked(tmp_path: Path) -> None:
    path = tmp_path / "keyed.fba"
    path.write_bytes(keyed([0, 90, 35, 60, 5, 75]))
    assert fba.read(path) == fba.read(path, bap_steps="iso") != fba.read(path, bap_steps="auto")
    assert fba.read(path, bap_steps="auto") == fba.read(path, bap_steps="visage")
