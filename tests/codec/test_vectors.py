"""Streams of real applications and of another encoder: values, masks, bytes and times must be exact."""

import json
import os
import warnings
from pathlib import Path
from typing import Any

import pytest

from fba import Animation, FbaWarning, Frame
from fba.codec import Decoder, encode_planes
from fba.formats import merge
from fba.formats.epf.epf import read_epf
from fba.formats.text.bap import read_bap
from fba.formats.text.fap import read_fap
from fba_conformance._values import plane_records
from fba_conformance.trace import decode_values

SHARED = Path(os.environ.get("FBA_SHARED") or Path(__file__).parents[3] / "shared")
INDEX = SHARED / "vectors" / "index.json"
ENTRIES: list[dict[str, Any]] = json.loads(INDEX.read_text(encoding="utf-8")) if INDEX.is_file() else []
BY_STREAM = {entry["stream"]: entry for entry in ENTRIES}
REAL = [name for name in BY_STREAM if name.startswith("real/")]
NO_FILES = "no shared test material; set FBA_SHARED to its folder"
REPEATED_TIME_CODE = "generated/synth_face_tc.fba"
OLD_START_CODE = "real/headmotion_long.fba"

pytestmark = pytest.mark.skipif(not ENTRIES, reason=NO_FILES)


def planes(name: str) -> list[Frame]:
    data = (SHARED / "vectors" / name).read_bytes()
    decoder = Decoder(bap_steps=BY_STREAM[name]["bap_steps"])
    return decoder.push(data) + decoder.finish()


def file(name: str, key: str) -> Path:
    return SHARED / "vectors" / BY_STREAM[name][key]


def test_the_index_is_whole() -> None:
    assert len(ENTRIES) == 177
    assert {name for name in BY_STREAM if not BY_STREAM[name]["same_bytes"]} == {
        REPEATED_TIME_CODE,
        OLD_START_CODE,
    }
    assert len(REAL) == 41


@pytest.mark.parametrize("name", [name for name in BY_STREAM if name != REPEATED_TIME_CODE])
def test_values_masks_and_bytes(name: str) -> None:
    entry = BY_STREAM[name]
    frames = planes(name)
    animation = Animation.from_frames(frames)
    source: list[Animation] = []
    for key, track, reader in (("fap", animation.face, read_fap), ("bap", animation.body, read_bap)):
        assert (f"decoded_{key}" in entry) == (track is not None)
        if track is None:
            continue
        expected = reader(file(name, f"decoded_{key}"))
        assert len(expected) == len(frames)
        assert track == (expected.face if key == "fap" else expected.body)
        source.append(reader(file(name, f"source_{key}")))
    if entry["same_bytes"]:
        to_encode = merge(*source) if len(source) == 2 else source[0]
        again = encode_planes(to_encode, read_epf(file(name, "epf")), bap_steps=entry["bap_steps"])
        assert again == (SHARED / "vectors" / name).read_bytes()


def test_time_codes_with_a_marker_of_0() -> None:
    """Its values are exact; the two time codes that a defect repeated are told of, and not followed."""
    with pytest.warns(
        FbaWarning, match="marker bit of time code .* is 0; that time code was not used"
    ) as caught:
        frames = planes(REPEATED_TIME_CODE)
    assert len(caught) == 2
    expected = read_fap(file(REPEATED_TIME_CODE, "decoded_fap"))
    assert Animation.from_frames(frames).face == expected.face
    times = [frame.time for frame in frames]
    assert times == sorted(set(times))


def test_old_plane_start_code() -> None:
    """The stream with an old start code comes out with its values, and goes in again without that code."""
    frames = planes(OLD_START_CODE)
    assert frames[0].plane.settings.start_code
    assert not any(frame.plane.settings.start_code for frame in frames[1:])
    source = read_fap(file(OLD_START_CODE, "source_fap"))
    again = encode_planes(source, read_epf(file(OLD_START_CODE, "epf")), bap_steps="visage")
    old = (SHARED / "vectors" / OLD_START_CODE).read_bytes()
    code = b"\x7f\0\0\1\x03"
    assert again[:4] + code + again[4:] == old


@pytest.mark.parametrize("name", REAL)
def test_planes_as_another_decoder_traced_them(name: str) -> None:
    """Per plane: parts, time, rate, skip, quantisers, gender, coding type, range flags, position and bits."""
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        frames = planes(name)
    lines = (SHARED / "vectors" / name).with_suffix(".trace").read_text(encoding="ascii").splitlines()
    assert len(lines) == len(frames)
    intra = None
    for number, (line, frame) in enumerate(zip(lines, frames, strict=True)):
        words = line.split()
        said = dict(zip(words[:20:2], words[1:20:2], strict=True))
        settings = frame.plane.settings
        assert frame.plane.number == number == int(said["frame"])
        assert settings.intra == bool(int(said["intra"]))
        assert (settings.face is not None) + 2 * (settings.body is not None) == int(said["paramset"])
        assert abs(frame.time * 1000 - int(said["pts"])) <= 1  # it adds up whole milliseconds
        assert frame.rate == int(said["rate"])
        intra = settings if settings.intra else intra
        assert intra.frame_rate is not None
        rate = intra.frame_rate
        assert f"{rate.frame_rate}/{rate.seconds}/{rate.frequency_offset}" == said["fr"]
        assert (intra.time_code is not None) == bool(int(said["tc"]))
        assert settings.skip == int(said["skip"])
        at = words.index("quant")
        quants = [part.quant if part is not None else 0 for part in (settings.face, settings.body)]
        assert quants == [int(word) for word in words[at + 1 : at + 3]]
        rest = dict(zip(words[at + 3 :: 2], words[at + 4 :: 2], strict=True))
        part = settings.face or settings.body
        assert part.gender == int(rest["gender"])
        assert part.coding_type == int(rest["coding"])
        if settings.face is not None:
            assert "".join(str(int(codes is not None)) for codes in settings.face.ranges) == rest["fminmax"]
        assert frame.plane.bit + frame.plane.bits == int(rest["total"])
        assert frame.plane.bits == int(rest["bits"])


@pytest.mark.parametrize(
    "name",
    [
        "generated/vreng_yes_b_std_q1.fba",
        "generated/vreng_sit_b_vis_q1.fba",
        "generated/vreng_fear_f_q8.fba",
        "generated/synth_face_visonly.fba",
        "generated/vreng_pivot_b_std_q1_i12.fba",
    ],
)
def test_same_planes_as_the_independent_reader(name: str) -> None:
    data = (SHARED / "vectors" / name).read_bytes()
    theirs = decode_values(data, bap_steps=BY_STREAM[name]["bap_steps"])
    frames = planes(name)
    assert [frame.plane.bit for frame in frames] == [plane["bit"] for plane in theirs]
    assert [frame.time for frame in frames] == [plane["time"] for plane in theirs]
    for frame, ours, plane in zip(frames, plane_records(frames), theirs, strict=True):
        assert (ours["intra"], ours["skip"], ours["bits"]) == (plane["intra"], plane["skip"], plane["bits"])
        assert ours["fap"] == {str(number): value for number, value in plane["fap"].items()}
        assert ours["bap"] == {str(number): value for number, value in plane["bap"].items()}
        for kind, part in (("fap", frame.plane.settings.face), ("bap", frame.plane.settings.body)):
            if part is not None:
                assert part.quant == plane[f"{kind}_quant"]
                assert part.mask_types == plane[f"{kind}_mask_types"]
                assert "".join(str(int(codes is not None)) for codes in part.ranges) == plane[f"{kind}_lists"]
