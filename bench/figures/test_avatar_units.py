"""Bytes of real captures as avatar animation units (ISO/IEC 23090-39), deflated live, and as FBA."""

from __future__ import annotations

import warnings
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import fba
from fba import EncoderOptions

FACES = ("livelink_capture.udp", "livelink_163_cal_600rows.csv", "mediapipe_WolfgangLanger_Pexels.csv")
BODIES = ("am_02_03.bvh", "bn_walk_masculine_025.bvh", "ad_rokoko_jesse_dance.bvh", "pfnn_flat09.bvh")
PACKED_BODY = 106.0
"""kbit/s of Meta's packing of 84 joints at 30 frames a second, as published."""
CENTIMETRE, HALF_A_MILLIMETRE = 0.01, 0.0005
_JOINTS = 4
"""First byte of a unit with joints."""


def split(units: bytes) -> Iterator[bytes]:
    """Yield units one by one."""
    at = 0
    while at < len(units):
        end = at + 5 + int.from_bytes(units[at + 1 : at + 5], "big")
        yield units[at:end]
        at = end


def without_joints(units: bytes) -> bytes:
    return b"".join(unit for unit in split(units) if unit[0] != _JOINTS)


def deflated_live(units: bytes) -> int:
    """Return the bytes of units deflated as they are sent: one by one, each with all before it as context."""
    packer = zlib.compressobj(9)
    return sum(len(packer.compress(unit) + packer.flush(zlib.Z_SYNC_FLUSH)) for unit in split(units))


def as_units(animation: fba.Animation, path: Path) -> bytes:
    """Return the bytes of an animation as units."""
    fba.write(path, animation)
    return path.read_bytes()


def read(path: Path, **options: Any) -> fba.Animation:
    if not path.is_file():
        pytest.skip(f"no {path.name} here")
    with warnings.catch_warnings(action="ignore", category=fba.FbaWarning):
        return fba.read(path, **options)


@pytest.mark.parametrize("name", FACES)
def test_faces(
    benchmark: Any, shared: Path, tmp_path: Path, report: Callable[[str], None], name: str
) -> None:
    """The units hold the weights alone, as those of phones do; head and eyes are in the streams besides."""
    animation = read(shared / "data" / "capture" / name)
    units = without_joints(as_units(animation, tmp_path / "a.aau"))
    options = EncoderOptions(clamp=True)
    exact = benchmark.pedantic(
        lambda: fba.encode(animation, options, preset="exact"), rounds=1, warmup_rounds=1
    )
    streams = {
        "exact": exact,
        "compact": fba.encode(animation, options, preset="compact"),
        "within 0.5 mm": fba.encode(animation, options, tolerance=HALF_A_MILLIMETRE),
    }
    _say(report, benchmark, name, animation, units, {what: len(data) for what, data in streams.items()})


@pytest.mark.parametrize("name", BODIES)
def test_bodies(
    benchmark: Any, shared: Path, tmp_path: Path, report: Callable[[str], None], name: str
) -> None:
    animation = read(shared / "data" / "foreign" / "bodies" / name, origin="start").resample(30)
    units = as_units(animation, tmp_path / "a.aau")
    options = EncoderOptions(clamp=True, bap_steps="visage")
    near = benchmark.pedantic(
        lambda: fba.encode(animation, options, tolerance=CENTIMETRE), rounds=1, warmup_rounds=1
    )
    exact = fba.encode(animation, options, preset="exact")
    _say(report, benchmark, name, animation, units, {"exact": len(exact), "within 1 cm": len(near)})
    seconds = len(animation) / float(animation.rate)
    report(f"    {PACKED_BODY / (8e-3 * len(near) / seconds):.0f} times less than {PACKED_BODY:g} kbit/s")


def _say(
    report: Callable[[str], None], benchmark: Any, name: str, animation: fba.Animation, units: bytes,
    streams: dict[str, int],
) -> None:  # fmt: skip
    seconds = len(animation) / float(animation.rate)
    sizes = {"units": len(units), "deflated live": deflated_live(units), **streams}
    rates = {what: 8e-3 * size / seconds for what, size in sizes.items()}
    benchmark.extra_info.update(rates)
    listed = ", ".join(f"{what} {rate:.1f} (1/{rates['units'] / rate:.0f})" for what, rate in rates.items())
    report(f"{name}: kbit/s: {listed}")
