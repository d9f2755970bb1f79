"""The client in the page, in node, with a connection that the test plays."""

import base64
import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fba.codec import Decoder, encode_animation
from fba.serving import split_stream
from joinable_streams import JOINABLE, performance

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="no node here")
ADDRESS = "ws://127.0.0.1:8080/token/stream?n=3"
STREAM = encode_animation(performance(body=False), JOINABLE)[0]
FRAMES = Decoder().push(STREAM)
PLANES, ENDING = split_stream(STREAM)


def play(folder: Path, steps: list[dict[str, Any]]) -> list[Any]:
    """Return what `LiveStream` called; frames as one flat list."""
    script = folder / "script.json"
    script.write_text(json.dumps(steps))
    program = str(Path(__file__).with_name("play_live.mjs"))
    done = subprocess.run(["node", program, script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    called: list[Any] = json.loads(done.stdout)
    return called


def sent(data: bytes) -> dict[str, str]:
    return {"bytes": base64.b64encode(data).decode()}


def start(time: float) -> dict[str, Any]:
    return {"text": {"event": "start", "time": time, "rate": 25}}


def test_frames_from_the_start_and_from_an_i_plane_after_losses(tmp_path: Path) -> None:
    hello = {"text": {"event": "hello", "streams": ["a", "b"], "stream": 3}}
    steps = [
        {"open": 1},
        hello,
        start(0.0),
        sent(PLANES[0].opening),
        *(sent(one.data) for one in PLANES[1:12]),
    ]
    steps += [{"text": {"event": "lost", "planes": 23}}, start(7.4), sent(PLANES[25].opening)]
    steps += [
        *(sent(one.data) for one in PLANES[26:]),
        sent(ENDING),
        {"text": {"event": "end"}},
        {"close": 1000},
    ]
    called = play(tmp_path, steps)
    assert called[:5] == [
        ["state", "connecting", 0], ["socket", ADDRESS], ["state", "open", 0], ["hello", ["a", "b"], 3],
        ["start", 0, 25],
    ]  # fmt: skip
    assert called[-3:] == [["end"], ["socket closed"], ["state", "over", 0]]
    assert [one for one in called if one[0] in ("lost", "start")][1:] == [["lost", 23], ["start", 7.4, 25]]
    frames = [frame for one in called if one[0] == "frames" for frame in one[1:]]
    expected = [*range(12), *range(25, len(FRAMES))]
    # the stream says 1 second for plane 25, the server 7.4: it knows
    times = [number / 25 + (6.4 if number > 12 else 0) for number in expected]
    assert [time for time, _ in frames] == pytest.approx(times)
    for (_, values), number in zip(frames, expected, strict=True):
        np.testing.assert_array_equal(values, FRAMES[number].face.values[0])


def test_it_opens_again_after_pauses_that_grow(tmp_path: Path) -> None:
    broken = [{"close": 1006}, {"later": 1}]
    called = play(tmp_path, [*(7 * broken), {"open": 1}, start(0), {"close": 1001}])
    pauses = [one[2] for one in called if one[:2] == ["state", "waiting"]]
    assert pauses == [0.5, 1, 2, 4, 8, 15, 15, 0.5]
    assert called.count(["socket", ADDRESS]) == 8


@pytest.mark.parametrize("bad", [sent(b"\0\0\1\xba" + b"\x20" * 100), {"raw": "{"}, {"raw": "null"}])
def test_bytes_that_cannot_be_decoded_open_it_again(tmp_path: Path, bad: dict[str, str]) -> None:
    called = play(tmp_path, [{"open": 1}, start(0), bad, {"later": 1}, {"open": 1}])
    kinds = [one[0] for one in called]
    assert "frames" not in kinds
    assert called[kinds.index("error") + 1 :] == [
        ["socket closed"], ["state", "waiting", 0.5], ["state", "connecting", 0], ["socket", ADDRESS],
        ["state", "open", 0],
    ]  # fmt: skip


@pytest.mark.parametrize("before", [[], [{"open": 1}], [{"close": 1006}]])
def test_closing_it(tmp_path: Path, before: list[dict[str, Any]]) -> None:
    called = play(tmp_path, [*before, {"end": 1}, {"end": 1}])
    assert (called.count(["state", "closed", 0]), called[-1]) == (1, ["state", "closed", 0])
