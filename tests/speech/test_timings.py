"""Files of timings as other programs write them, and such that are damaged.

Phones in ARPAbet and IPA, the visemes that they show, and the words of texts.
"""

import importlib.util
import json
import sys
from pathlib import Path

import numpy as np
import pytest

import fba
from fba.errors import FormatError, UnsupportedError
from fba.speech import Phone, find_shapes, find_timings, format_visemes, read_timings, split_text

needs_gruut = pytest.mark.skipif(importlib.util.find_spec("gruut") is None, reason="gruut is not installed")
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
CUES = [(0.0, 0.1, "A"), (0.1, 0.4, "D"), (0.4, 0.5, "A")]
RHUBARB_JSON = json.dumps(
    {
        "metadata": {"soundFile": "map.wav", "duration": 0.5},
        "mouthCues": [{"start": start, "end": end, "value": mouth} for start, end, mouth in CUES],
    }
)
RHUBARB_TSV = "0.00\tA\n0.10\tD\n0.40\tA\n0.50\tX\n"
AZURE = json.dumps(
    [{"audio_offset": at, "viseme_id": number} for at, number in ((0, 21), (1_000_000, 1), (4_000_000, 21))]
)
OCULUS = json.dumps(
    {"visemes": [{"time": at, "viseme": name} for at, name in ((0.0, "PP"), (0.1, "aa"), (0.4, "PP"))]}
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
RHUBARB_XML = """<?xml version="1.0" encoding="utf-8"?>
<rhubarbResult>
  <metadata>
    <soundFile>map.wav</soundFile>
    <duration>0.50</duration>
  </metadata>
  <mouthCues>
    <mouthCue start="0.00" end="0.10">A</mouthCue>
    <mouthCue start="0.10" end="0.40">D</mouthCue>
    <mouthCue start="0.40" end="0.50">A</mouthCue>
  </mouthCues>
</rhubarbResult>
"""
RHUBARB_WASM = RHUBARB_JSON.replace('"end": 0.4', '"end": 0.48')  # cues reach into the next ones there
MOHO = "MohoSwitch1\n1 MBP\n2 rest\n2 AI\n5 MBP\n6 rest\n"
PAPAGAYO = """lipsync version 1
map.wav
10
5
1
\tVoice 1
\tmap
\t1
\t\tmap
\t\t0
\t\t4
\t\t2
\t\t\tma 0 3 2
\t\t\t\t0 MBP
\t\t\t\t1 AI
\t\t\tp 4 4 1
\t\t\t\t4 MBP
"""
POLLY = """{"time":0,"type":"sentence","start":0,"end":4,"value":"Map."}
{"time":0,"type":"word","start":0,"end":3,"value":"Map"}
{"time":0,"type":"viseme","value":"p"}
{"time":100,"type":"viseme","value":"a"}
{"time":400,"type":"viseme","value":"p"}
"""
MFA_JSON = json.dumps(
    {
        "start": 0,
        "end": 0.5,
        "tiers": {
            "words": {"type": "interval", "entries": [[0.0, 0.5, "map"]]},
            "phones": {"type": "interval", "entries": [[0.0, 0.1, "m"], [0.1, 0.4, "æ"], [0.4, 0.5, "pʰ"]]},
        },
    }
)
MFA_CSV = """Begin,End,Label,Type,Speaker
0.0,0.5,map,words,anna
0.0,0.1,M,phones,anna
0.1,0.4,AE1,phones,anna
0.4,0.5,P,phones,anna
"""
EXPECTED = [(1, 0.0, 0.1), (10, 0.1, 0.4), (1, 0.4, 0.5)]


FILES = {
    "long TextGrid": LONG_TEXTGRID,
    "short TextGrid": SHORT_TEXTGRID,
    "TextGrid in Windows' lines": LONG_TEXTGRID.replace("\n", "\r\n"),
    "CTM": CTM,
    "SRT": SRT,
    "MFA, JSON": MFA_JSON,
    "MFA, CSV": MFA_CSV,
    "Rhubarb, JSON": RHUBARB_JSON,
    "Rhubarb, TSV": RHUBARB_TSV,
    "Rhubarb, XML": RHUBARB_XML,
    "Rhubarb, WASM": RHUBARB_WASM,
    "Moho": MOHO.replace("1\n", "1\nFPS 10\n", 1),
    "Moho, Rhubarb's letters": "MohoSwitch1\nFPS 10\n1 A\n2 D\n5 A\n6 X\n",
    "Papagayo": PAPAGAYO,
    "Papagayo, CMU's phones": PAPAGAYO.replace("MBP", "M").replace("AI", "AE"),
    "Polly": POLLY,
    "Polly, as a list": json.dumps([json.loads(line) for line in POLLY.splitlines()]),
    "Oculus": OCULUS,
    "Azure": AZURE,
    "Azure, in ms": AZURE.replace("1000000", "100").replace("4000000", "400"),
    "Azure, in seconds": AZURE.replace("1000000", "0.1").replace("4000000", "0.4"),
    "Azure, JavaScript": AZURE.replace("audio_offset", "audioOffset").replace("viseme_id", "visemeId"),
}


@pytest.mark.parametrize("text", FILES.values(), ids=FILES)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_timings_are_read(text: str, encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "timings"
    path.write_bytes(text.encode(encoding))
    speech = read_timings(path)
    shapes = [(shape.viseme, shape.start, shape.end) for shape in find_shapes(speech.phones)]
    assert [shape for shape in shapes if shape[0]] == [pytest.approx(each) for each in EXPECTED]
    assert 0.5 <= speech.seconds + 1e-9 < 0.65


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
        ("jawOpen,mouthClose\n0,1\n", "ARKit's curves.*`fba speak` takes them"),
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
        (RHUBARB_XML.replace('end="0.40"', "end="), "mouth cues that are cut off or damaged"),
        (MOHO.replace("5 MBP", "5 mouth"), "entry 4, at 0.166667 s: 'mouth' is no phone"),
        (MOHO.replace("5 MBP", "five MBP"), "damaged: ValueError"),
        (MOHO.replace("1\n", "1\nFPS 0\n", 1), "damaged: ZeroDivisionError"),
        (PAPAGAYO[:-20], "damaged: (IndexError|ValueError)"),
        (POLLY.replace('"a"', '"%"'), "damaged: KeyError"),
        (MFA_JSON.replace("phones", "tones"), "no tier named phones; its tiers are words, tones"),
        (MFA_CSV.replace("phones,anna", "phones,ben", 1), "holds 2 speakers"),
        ("[]", "holds no timings"),
        ("{}", "no list of visemes"),
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


def test_no_frames_have_no_timings() -> None:
    motion = fba.read(Path(fba.__file__).parent / "samples" / "hello.fap")
    with pytest.raises(FormatError, match="no frames"):
        find_timings(motion[:0])


WRITERS = {
    "Moho": ("MohoSwitch1\nFPS {rate}\n{rows}\n", "{frame} {drawing}", 1),
    "Rhubarb": ("{rows}\n", "{time:.4f}\t{letter}", 0),
    "Azure": ("[{rows}]", '{{"audio_offset": {ticks}, "viseme_id": {azure}}},', 0),
    "Polly": ("{rows}\n", '{{"time": {ms}, "type": "viseme", "value": "{polly}"}}', 0),
}
"""Head, row and number of the first frame of each kind."""
MOUTHS = {
    0: ("rest", "X", 0, "sil"),
    1: ("MBP", "A", 21, "p"),
    2: ("FV", "G", 18, "f"),
    10: ("AI", "D", 2, "a"),
}
"""Names of visemes in these files: drawing, letter, Azure's number, Polly's letter."""


@pytest.mark.parametrize("kind", WRITERS)
@pytest.mark.parametrize("seed", range(6))
def test_random_mouths_come_back(kind: str, seed: int, tmp_path: Path) -> None:
    """Files with any number of mouths, at any rate, long and short ones."""
    rng = np.random.default_rng(seed)
    head, row, first = WRITERS[kind]
    rate, frame, before = int(rng.choice([24, 25, 30, 100])), 0, -1
    expected, rows = [], []
    for _ in range(int(rng.integers(2, 200))):
        viseme = int(rng.choice([each for each in MOUTHS if each != before]))
        drawing, letter, azure, polly = MOUTHS[viseme]
        time = frame / rate
        expected.append((viseme, time))
        rows.append(
            row.format(
                frame=frame + first, drawing=drawing, time=time, letter=letter, ticks=round(time * 1e7),
                azure=azure, ms=round(time * 1000), polly=polly,
            )
        )  # fmt: skip
        frame, before = frame + int(rng.integers(1, 20)), viseme
    text = head.format(rate=rate, rows="\n".join(rows))
    (tmp_path / "made").write_text(text.replace("},]", "}]"), encoding="utf-8")
    found = find_shapes(read_timings(tmp_path / "made").phones)
    if kind == "Rhubarb":
        expected.pop()  # its last row is the end
    assert [shape.viseme for shape in found] == [viseme for viseme, _ in expected]
    assert [shape.start for shape in found] == pytest.approx([time for _, time in expected], abs=0.001)


@pytest.mark.parametrize(
    ("name", "visemes"),
    [
        ("P", [1]), ("m", [1]), ("f", [2]), ("TH", [3]), ("ð", [3]), ("T", [4]), ("ŋ", [5]), ("tʃ", [6]),
        ("z", [7]), ("N", [8]), ("ɹ", [9]), ("AA1", [10]), ("ˈɑː", [10]), ("EH0", [11]), ("iː", [12]),
        ("AO2", [13]), ("UW", [14]), ("AY1", [10, 12]), ("oʊ", [13, 14]), ("y", [14, 12]), ("SIL", [0]),
        ("", [0]), ("pau", [0]), ("h", [0]), ("ɛ̃", [11]),
    ],
)  # fmt: skip
def test_phones_show_visemes_of_the_standards_table(name: str, visemes: list[int]) -> None:
    assert [shape.viseme for shape in find_shapes([Phone(name, 0.0, 0.1)])] == visemes


def test_the_first_part_of_a_diphthong_is_the_longer() -> None:
    first, second = find_shapes([Phone("AY", 1.0, 2.0)])
    assert (first.start, first.end, second.start, second.end) == (1.0, 1.6, 1.6, 2.0)


@pytest.mark.parametrize("name", ["QQ", "xyz!", "12"])
def test_unknown_phones_are_refused(name: str) -> None:
    with pytest.raises(FormatError, match="is no phone of ARPAbet or IPA"):
        find_shapes([Phone(name, 0.0, 1.0)])


@needs_gruut
def test_numbers_and_abbreviations_become_words() -> None:
    words = split_text("Dr. Smith paid $25, <b>he</b> said &quot;thanks&quot;.")
    assert " ".join(word.text for word in words) == "doctor smith paid twenty five dollars he said thanks"
    assert all(word.phones for word in words)


@needs_gruut
def test_unknown_words_are_pronounced() -> None:
    (word,) = split_text("blurfnag")
    assert [name for name, _ in word.arpabet][:5] == ["B", "L", "ER", "F", "N"]


@pytest.mark.parametrize(
    ("text", "language", "error", "said"),
    [
        ("", "en-us", FormatError, "has no words"),
        ("...", "en-us", FormatError, "has no words"),
        ("Привет, мир", "en-us", FormatError, "letters of the Cyrillic script"),
        ("one\n你好", "en-us", FormatError, "line 2: .*letters of the Cjk script"),
        ("a" * 1_000_001, "en-us", FormatError, "1000001 letters"),
        ("Saluton", "eo", UnsupportedError, "'eo'"),
    ],
)
def test_texts_that_cannot_be_spoken_are_refused(
    text: str, language: str, error: type[Exception], said: str
) -> None:
    with pytest.raises(error, match=said):
        split_text(text, language)


def test_without_gruut_words_are_split_and_numbers_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "gruut", None)
    assert [word.text for word in split_text("Don't STOP — now!")] == ["don't", "stop", "now"]
    with pytest.raises(UnsupportedError, match=r"the number 'No\.5' in the text needs the package gruut"):
        split_text("It is No.5 of them")
    with pytest.raises(UnsupportedError, match="'de-de' needs the package gruut"):
        split_text("Guten Tag", "de-de")
