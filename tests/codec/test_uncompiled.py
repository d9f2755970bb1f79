"""Without machine code, and without numba at all: the same values and bytes, slower, and no warning."""

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from fba import compiled
from tools.fuzz.small_streams import small_streams

SCRIPT = """
import sys
if "no-numba" in sys.argv:
    sys.modules["numba"] = None
import hashlib, json
import fba
from fba import compiled
from tools import synthetic_motion as motion
from tools.fuzz import _engine as fuzz
from tools.fuzz.targets import find_target
from tools.fuzz.small_streams import small_streams
from fractions import Fraction

result = {"compiled": compiled.is_compiled(), "numba": sys.modules.get("numba") is not None}
streams = list(small_streams().values())
result["bytes"] = hashlib.sha256(b"|".join(streams)).hexdigest()
long = fba.encode(motion.animation(motion.face(30, high_level=True), motion.body(30)))
result["long"] = hashlib.sha256(long).hexdigest()
values = hashlib.sha256()
for stream in [*streams, long]:
    decoder = fba.Decoder()
    for frame in decoder.push(stream) + decoder.finish():
        for track in (frame.face, frame.body):
            if track is not None:
                values.update(track.values.tobytes() + track.mask.tobytes())
        if frame.face is not None:
            values.update(frame.face.viseme.tobytes() + frame.face.expression.tobytes())
result["values"] = values.hexdigest()
from fba.codec import Encoder, EncoderOptions
from fba.planning._code_lengths import code_lengths
import numpy as np
moving = motion.animation(motion.face(30), motion.body(30))
options = EncoderOptions()
lengths = [code_lengths(one, np.array([0, 11, 30]), options) for one in (moving.face, moving.body)]
result["lengths"] = [round(float(one.sum()), 6) for one in lengths]
encoder = Encoder(options)
encoder.push_animation(moving[:20])
encoder.settle(20)
plane = encoder.next_plane(moving[20:21])
chosen = [plane.levels(np.full(364, 1e-4), price) for price in (0.0, 0.5, 4.0, float("inf"))]
result["levels"] = [hashlib.sha256(one.tobytes()).hexdigest() for one in chosen]
result["bits"] = [plane.bits(one) for one in chosen]
report = fuzz.run(find_target("stream"), streams[:3], count=60, seed=3)
result["fuzz"] = [report.accepted, report.refused, report.salvaged, report.planes]
result["findings"] = [finding.reason for finding in report.findings]
print(json.dumps(result))
"""


def run(*arguments: str, **environment: str) -> dict[str, object]:
    """The script's result, in a process of its own where every warning is an error."""
    script = subprocess.run(
        [sys.executable, "-W", "error", "-c", SCRIPT, *arguments],
        cwd=Path(__file__).parents[2],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert script.returncode == 0, script.stderr
    result: dict[str, object] = json.loads(script.stdout)
    return result


@pytest.fixture(scope="module")
def usual() -> dict[str, object]:
    """The result as this installation comes, compiled where numba is there."""
    result = run()
    assert result["compiled"] == compiled.is_compiled()
    assert result["findings"] == []
    assert result["bytes"] == hashlib.sha256(b"|".join(small_streams().values())).hexdigest()
    return result


@pytest.mark.parametrize("way", ["NUMBA_DISABLE_JIT=1", "no numba"])
def test_the_same_without_machine_code(way: str, usual: dict[str, object]) -> None:
    result = run(NUMBA_DISABLE_JIT="1") if way == "NUMBA_DISABLE_JIT=1" else run("no-numba")
    assert result["compiled"] is False
    if way == "no numba":
        assert result["numba"] is False
    same = ("bytes", "long", "values", "fuzz", "findings", "lengths", "levels", "bits")
    assert {name: result[name] for name in same} == {name: usual[name] for name in same}


def test_an_empty_folder_of_numba_counts_as_missing() -> None:
    """What an uninstalled numba may leave behind can be imported, and holds nothing."""
    script = (
        "import sys; sys.modules['numba'] = type(sys)('numba'); from fba import compiled; import fba.codec"
    )
    subprocess.run(
        [sys.executable, "-W", "error", "-c", f"{script}; assert not compiled.is_compiled()"], check=True
    )
