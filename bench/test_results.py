"""Results that are no times: test vectors, sizes, how close captures come, models against the standard; and
the clock of the sound. They are benchmarks so that `./dev bench --summary` finds them with the others.
"""

from __future__ import annotations

import json
import math
import time
import warnings
import wave
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fba
from fba import Animation, FaceTrack
from fba.capture import from_skeleton, retarget_report
from fba.errors import FbaWarning
from fba.face import FaceModel, checks
from fba.face.importers import import_model
from fba.formats.bvh._reader import read_motion
from fba_conformance.suite.index import read_vectors
from fba_conformance.suite.runner import check

CAPTURES = (
    "vreng/cmu_walk", "greta/Dance", "greta/Fluid_gesture", "greta/GangnamStyle", "greta/c-Walkaround",
    "greta/c-ladder", "greta/fast_gesture", "greta/sad_walk_rd", "greta/strong_gesture",
)  # fmt: skip
HEARD = 30.0
"""Seconds for which the clock of the sound is read."""
EVERY = 0.002
"""Seconds from one reading to the next."""


def once(benchmark: Any, function: Callable[[], Any]) -> Any:
    """The function's result; how long it takes is no result here."""
    return benchmark.pedantic(function, rounds=1)


def conformance(benchmark: Any, folder: Path | None) -> dict[str, int]:
    results = once(benchmark, lambda: [check(vector) for vector in read_vectors(folder)])
    counts = {
        "count": len(results),
        "passed": sum(result.passed for result in results),
        "decoded": sum(result.decoded for result in results),
        "encoded": sum(result.encoded is True for result in results),
        "to_encode": sum(result.encoded is not None for result in results),
    }
    benchmark.extra_info.update(counts)
    return counts


def test_vectors_of_others(benchmark: Any, shared: Path, report: Callable[[str], None]) -> None:
    found = conformance(benchmark, shared / "vectors")
    report(
        f"vectors of others: {found['decoded']} of {found['count']} decoded, "
        f"{found['encoded']} of {found['to_encode']} encoded again"
    )
    assert found["passed"] == found["count"]


def test_own_vectors(benchmark: Any, report: Callable[[str], None]) -> None:
    found = conformance(benchmark, None)
    report(f"own vectors: {found['passed']} of {found['count']}")
    assert found["passed"] == found["count"]


def test_size_of_real_streams(benchmark: Any, shared: Path, report: Callable[[str], None]) -> None:
    """Decoded, and encoded again with the encoder's own ranges: the same frames from fewer bytes."""
    index = json.loads((shared / "vectors" / "index.json").read_text(encoding="utf-8"))
    real = [entry for entry in index if entry["stream"].startswith("real/")]

    def encoded() -> tuple[int, int]:
        before = after = 0
        for entry in real:
            data = (shared / "vectors" / entry["stream"]).read_bytes()
            animation = fba.decode(data, bap_steps=entry["bap_steps"])
            smaller = fba.encode(animation, fba.EncoderOptions(bap_steps=entry["bap_steps"]))
            assert fba.decode(smaller, bap_steps=entry["bap_steps"]) == animation
            before += len(data)
            after += len(smaller)
        return before, after

    before, after = once(benchmark, encoded)
    benchmark.extra_info.update(streams=len(real), before=before, after=after, percent=100 * after / before)
    report(f"{len(real)} real streams encoded again: {after} bytes, {100 * after / before:.1f} % of {before}")


def test_captures(benchmark: Any, shared: Path, report: Callable[[str], None]) -> None:
    paths = [shared / "data" / f"{name}.bvh" for name in CAPTURES]
    if missing := [path.name for path in paths if not path.is_file()]:
        pytest.skip(f"the shared material lacks {', '.join(missing)}")

    def compared() -> list[Any]:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FbaWarning)  # times of frames that no frame rate has exactly
            motions = [read_motion(path) for path in paths]
        return [retarget_report(motion, from_skeleton(motion)) for motion in motions]

    reports = once(benchmark, compared)
    feet = [(one.feet, one.feet.frames) for one in reports if one.feet is not None]
    assert len(feet) == len(CAPTURES)
    frames = [count for _, count in feet]
    found = {
        "worst": max(one.worst for one in reports),
        "mean": float(np.average([one.mean for one in reports], weights=[one.frames for one in reports])),
        "feet_mean": 1e3 * float(np.average([one.mean for one, _ in feet], weights=frames)),
        "feet_worst": 1e3 * max(one.worst for one, _ in feet),
        "feet_within": 100 * float(np.average([one.within for one, _ in feet], weights=frames)),
    }
    benchmark.extra_info.update(found)
    report(
        f"{len(reports)} captures, {sum(one.frames for one in reports)} frames: bones {found['mean']:.3f} "
        f"degrees off on average, {found['worst']:.2f} at worst; feet {found['feet_mean']:.2f} mm, "
        f"{found['feet_worst']:.1f} at worst, {found['feet_within']:.3f} % within 1 cm"
    )


@pytest.mark.parametrize("name", ["built-in head", "MakeHuman", "MakeHuman's FAPs"])
def test_validation(
    benchmark: Any, name: str, request: pytest.FixtureRequest, report: Callable[[str], None]
) -> None:
    if name == "built-in head":
        model = FaceModel.default()
    else:
        path = request.getfixturevalue("shared") / "models" / "makehuman" / "base.obj"
        if not path.is_file():
            pytest.skip("the shared material lacks MakeHuman's base mesh")
        model = import_model(path)
    neutral = [] if name == "MakeHuman's FAPs" else checks.check_neutral(model)
    findings = neutral + once(benchmark, lambda: checks.check_faps(model))
    errors = sum(finding.severity == "error" for finding in findings)
    benchmark.extra_info.update(errors=errors, warnings=len(findings) - errors)
    report(f"{name} against the standard: {errors} errors, {len(findings) - errors} warnings")


def test_sound_clock(benchmark: Any, tmp_path: Path, report: Callable[[str], None]) -> None:
    """A null device takes samples by the wall clock: the clock of the sound must keep a constant distance."""
    pytest.importorskip("miniaudio")
    from fba_player.playback._timeline import Timeline
    from fba_player.playback._transport import Transport
    from fba_player.sound._player import Audio

    rate = 48_000
    path = tmp_path / "tone.wav"
    with wave.open(str(path), "wb") as file:
        file.setparams((1, 2, rate, 0, "NONE", ""))
        tone = 8000 * np.sin(np.arange(rate * math.ceil(HEARD + 5)) * (440 * 2 * np.pi / rate))
        file.writeframes(tone.astype("<i2").tobytes())
    frames = math.ceil(25 * (HEARD + 5))
    transport = Transport(Timeline(Animation(25, np.arange(frames), face=FaceTrack.empty(frames))))
    distances = []

    def listen() -> None:
        with Audio(path, transport, backend="null") as audio:
            transport.play()
            while audio.clock() <= 0:
                time.sleep(EVERY)
            begun = time.monotonic()
            while (now := time.monotonic()) < begun + HEARD:
                distances.append(audio.clock() - now)
                time.sleep(EVERY)

    once(benchmark, listen)
    off = np.abs(np.array(distances) - np.median(distances))
    within = float(np.quantile(off, 0.99)) * 1e3
    benchmark.extra_info.update(milliseconds=within, readings=len(off))
    report(
        f"clock of the sound: 99 % of {len(off)} readings within {within:.1f} ms, worst {1e3 * off.max():.1f}"
    )
