"""Names of shapes: spellings of ARKit's blendshapes, and FAPs."""

from __future__ import annotations

import pytest

from fba.face import arkit_names, arkit_of
from fba.face.shape_names import canonical_names, fap_of


def test_there_are_52_and_each_knows_itself() -> None:
    assert len(set(arkit_names())) == 52
    assert [arkit_of(name) for name in arkit_names()] == list(arkit_names())


@pytest.mark.parametrize(
    ("written", "shape"),
    [
        ("eyeBlink_L", "eyeBlinkLeft"),
        ("EyeBlinkLeft", "eyeBlinkLeft"),
        ("Left_Eye_Blink", "eyeBlinkLeft"),
        ("blendShape1.eyeBlink_R", "eyeBlinkRight"),
        ("Fcl_EYE_Close_L", "eyeBlinkLeft"),
        ("JAW_OPEN", "jawOpen"),
        ("mouth-open", "jawOpen"),
        ("browInnerUp", "browInnerUp"),
        ("mouth_Left", "mouthLeft"),
        ("mouthRollLower", "mouthRollLower"),
        ("viseme_PP", None),
        ("target 3", None),
        ("", None),
        ("eyes", None),
    ],
)
def test_spellings(written: str, shape: str | None) -> None:
    assert arkit_of(written) == shape


def test_faps_by_name() -> None:
    assert fap_of("open_jaw") == 3
    assert fap_of("Pull_R_Ear") == 68
    assert fap_of("viseme") is None
    assert fap_of("jawOpen") is None


def test_the_first_of_several_counts() -> None:
    assert canonical_names(["x", "eyeBlink_L", "blink_L"]) == {"eyeBlinkLeft": "eyeBlink_L"}


def test_words_before_all_names_are_left_out() -> None:
    names = ["A14_Eye_Blink_Left", "A25_Jaw_Open", "A30_Mouth_Left", "T01_Tongue_Up"]
    assert canonical_names(names) == {"eyeBlinkLeft": names[0], "jawOpen": names[1], "mouthLeft": names[2]}
    assert canonical_names(["low_mouthOpen", "half_jawOpen", "x", "y"]) == {}
    # where a name is known as it stands, none is shortened
    assert list(canonical_names(["jawOpen", "far_jawLeft", "far_jawRight", "far_x"])) == ["jawOpen"]
