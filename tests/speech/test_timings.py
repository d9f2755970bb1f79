"""Files of timings as other programs write them, and such that are damaged."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from fba.errors import FormatError
from fba.speech import find_shapes, format_visemes, read_timings

LONG_TEXTGRID = """File type = "ooTextFile"
Object class = "TextGrid"

xmin = 0
xmax = 0.5
tiers? <exists>
size = 2
item []:
    item [1]:
        class = "IntervalTier"
        name = "words"
        xmin = 0
        xmax = 0.5
        intervals: size = 1
        intervals [1]:
            xmin = 0
            xmax = 0.5
            text = "map ""2"" "
    item [2]:
        class = "IntervalTier"
        name = "phones"
        xmin = 0
        xmax = 0.5
        intervals: size = 3
        intervals [1]:
            xmin = 0
            xmax = 0.1
            text = "M"
        intervals [2]:
            xmin = 0.1
            xmax = 0.4
            text = "AE1"
        intervals [3]:
            xmin = 0.4
            xmax = 0.5
            text = "P"
"""
SHORT_TEXTGRID = """File type = "ooTextFile"
Object class = "TextGrid"

0
0.5
<exists>
1
"IntervalTier"
"speaker - phones"
0
0.5
3
0
0.1
"M"
0.1
0.4
"AE1"
0.4
0.5
"P"
"""
CTM = ";; made by an aligner\nmap 1 0.00 0.10 M_B 0.99\nmap 1 0.10 0.30 AE_I 0.98\nmap 1 0.40 0.10 P_E 1.0\n"
RHUBARB_JSON = json.dumps(
    {
        "metadata": {"soundFile": "map.wav", "duration": 0.5},
        "mouthCues": [
            {"start": 0.0, "end": 0.1, "value": "A"},
            {"start": 0.1, "end": 0.4, "value": "D"},
            {"start": 0.4, "end": 0.5, "value": "A"},
        ],
    }
)
RHUBARB_TSV = "0.00\tA\n0.10\tD\n0.40\tA\n0.50\tX\n"
AZURE = json.dumps(
    [
        {"audio_offset": 0, "viseme_id": 21},
        {"audio_offset": 1_000_000, "viseme_id": 1},
        {"audio_offset": 4_000_000, "viseme_id": 21},
    ]
)
OCULUS = json.dumps(
    {
        "visemes": [
            {"time": 0.0, "viseme": "PP"},
            {"time": 0.1, "viseme": "aa"},
            {"time": 0.4, "viseme": "PP"},
        ]
    }
)
SRT = """1
00:00:00,000 --> 00:00:00,100
M

2
00:00:00,100 --> 00:00:00,400
AE

3
00:00:00,400 --> 00:00:00,500
P
"""
EXPECTED = [(1, 0.0, 0.1), (10, 0.1, 0.4), (1, 0.4, 0.5)]


@pytest.mark.parametrize(
    "text",
    [LONG_TEXTGRID, SHORT_TEXTGRID, CTM, RHUBARB_JSON, RHUBARB_TSV, AZURE, OCULUS, SRT],
    ids=["long", "short", "ctm", "rhubarb", "tsv", "azure", "oculus", "srt"],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_timings_are_read(text: str, encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "timings"
    path.write_bytes(text.encode(encoding))
    speech = read_timings(path)
    shapes = [(shape.viseme, shape.start, shape.end) for shape in find_shapes(speech.phones)]
    assert shapes == [pytest.approx(each) for each in EXPECTED]
    assert speech.seconds == pytest.approx(0.5)


@pytest.mark.parametrize("kind", ["json", "textgrid"])
def test_written_visemes_are_read_again(kind: str, tmp_path: Path) -> None:
    (tmp_path / "ctm").write_text(CTM, encoding="utf-8")
    shapes = find_shapes(read_timings(tmp_path / "ctm").phones)
    (tmp_path / "made").write_text(format_visemes(shapes, kind), encoding="utf-8")  # type: ignore[arg-type]
    again = find_shapes(read_timings(tmp_path / "made").phones)
    assert [(one.viseme, one.start, one.end) for one in again] == [
        pytest.approx((one.viseme, one.start, one.end)) for one in shapes
    ]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty"),
        ("hello world", "is no file of timings"),
        ("jawOpen,mouthClose\n0,1\n", "ARKit's curves.*fba encode"),
        (SHORT_TEXTGRID[:120], "cut off or damaged"),
        (SHORT_TEXTGRID.replace("\n3\n0\n", "\n999999999\n0\n"), "cut off or damaged"),
        (LONG_TEXTGRID.replace('"phones"', '"tones"'), "no tier named phones; its tiers are words, tones"),
        (CTM.replace("AE_I", "QX"), "entry 2, at 0.1 s: 'QX' is no phone"),
        (CTM.replace("map 1 0.40", "map 1 0.20"), "entry 3 begins at 0.2 s, before the one before it ends"),
        (CTM.replace("map 1 0.40", "other 1 0.40"), "holds 2 recordings"),
        (CTM.replace("0.30 AE", "1e300 AE"), "which is impossible"),
        (RHUBARB_JSON.replace('"D"', '"Q"'), "damaged: KeyError"),
        (RHUBARB_JSON[:-2], "damaged: JSONDecodeError"),
        (RHUBARB_JSON.replace("0.4,", "NaN,"), "which is impossible"),
        (AZURE.replace(": 1}", ": 99}"), "damaged: IndexError"),
        ("[]", "holds no timings"),
        ("{}", "damaged: TypeError"),
        ("[" * 100_000, "damaged: RecursionError"),
        (SRT.replace("-->", "==>", 1).replace("1\n", "1\n00:00:00 --> x\n", 1), "damaged: ValueError"),
    ],
)
def test_damaged_timings_are_refused(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "bad"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FormatError, match=said) as caught:
        read_timings(path)
    assert str(path) in str(caught.value)


def test_bytes_are_no_timings(tmp_path: Path) -> None:
    path = tmp_path / "bad"
    path.write_bytes(b"RIFF\xff\xfe\x80\x81")
    with pytest.raises(FormatError, match="is no text in UTF-8 or UTF-16"):
        read_timings(path)
