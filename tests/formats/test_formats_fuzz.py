"""Damaged FAP, BAP and EPF texts: an error of ours, or a result; nothing else, and quickly."""

from __future__ import annotations

import random
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from fba.errors import FbaError, FbaWarning
from fba.formats import read
from fba.formats.epf.epf import read_epf, write_epf
from fba.formats.text.bap import read_bap
from fba.formats.text.fap import read_fap, write_fap
from format_files import mask

WORDS = (
    b"", b" ", b"\n", b"\r", b"#", b"0", b"1", b"-1", b"2", b"1e308", b"-1e999", b"inf", b"nan", b".5",
    b"99999999999999999999",
    b"\0", b"\xff", b"1" * 70_000, b"2.1 a 25 1\n", b"3.2", b"1/0",
    b"29.97", b"FBM 3\n", b"ISI 0\n", b"FIX", b"x", b"+", b"\t", b"1 " * 68,
)  # fmt: skip

FAP = "\n".join(
    [
        "# c",
        "2.1 a b 25 3",
        mask(1, 2, 3, 50),
        "0 1 2 3 1 1 2 3 4 1 0 77 -5",
        mask(3),
        "1 5.5",
        mask(3, 68),
        "3 5 6",
        "",
    ]
).encode()
BAP = "\n".join(["3.1 a 25 2", mask(1, 186, width=186), "0 1 -2", mask(7, width=296), "4 5", ""]).encode()
EPF = "\n".join(
    [
        "FBM 3", "FFR 0", "BFR 0", "ISI 1", "FRR 25 0 0", "TC 0 0 1 0", "SKN 3",
        "FMT 0 3 0 0 1 1 0 0 0 0 0 0 2 1 0 0 0 0",
        "FQU 1", "FIX " + "60 " * 66, "BMT 0 0 0 0 0 1 1 1 0 0 1" + " 0" * 18, "BQU 2",
        "BIN " + "-61 " * 296, "GDR 1",
        "FBM 1", "FFR 1", "ISI 0", "",
    ]
).encode()  # fmt: skip


def mutations(data: bytes, seed: int, count: int) -> Iterator[bytes]:
    dice = random.Random(seed)
    for _ in range(count):
        damaged = data
        for _ in range(dice.randint(1, 4)):
            at = dice.randrange(len(damaged) + 1)
            to = min(len(damaged), at + dice.choice((0, 1, 1, 2, 5, 40, 400)))
            kind = dice.randrange(4)
            if kind == 0:
                damaged = damaged[:at] + dice.choice(WORDS) + damaged[to:]
            elif kind == 1:
                damaged = damaged[:at]
            elif kind == 2:
                damaged = damaged[:to] + damaged[at:to] + damaged[to:]
            elif at < len(damaged):
                damaged = damaged[:at] + bytes([damaged[at] ^ 1 << dice.randrange(8)]) + damaged[at + 1 :]
        yield damaged


@pytest.mark.parametrize("salvage", [False, True])
@pytest.mark.parametrize(("reader", "data"), [(read_fap, FAP), (read_bap, BAP)])
def test_damaged_text_is_an_error_of_ours(
    tmp_path: Path, reader: Callable[..., object], data: bytes, salvage: bool
) -> None:
    path = tmp_path / "a"
    good = unnamed = 0
    for damaged in mutations(data, 1, 1500):
        path.write_bytes(damaged)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", FbaWarning)
            try:
                reader(path, salvage=salvage)
                good += 1
            except FbaError as error:
                unnamed += str(path) not in str(error)
    assert 0 < good < 1500
    assert not unnamed


def test_damaged_epf_is_an_error_of_ours(tmp_path: Path) -> None:
    path = tmp_path / "a"
    good = unnamed = 0
    for damaged in mutations(EPF, 2, 1500):
        path.write_bytes(damaged)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", FbaWarning)
            try:
                planes = read_epf(path)
                write_epf(tmp_path / "b", planes)
                assert len(read_epf(tmp_path / "b")) == len(planes)
                good += 1
            except FbaError as error:
                unnamed += str(path) not in str(error)
    assert 0 < good < 1500
    assert not unnamed


def test_cut_at_every_byte(tmp_path: Path) -> None:
    path = tmp_path / "a.fap"
    frames = []
    for end in range(1, len(FAP)):
        path.write_bytes(FAP[:end])
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", FbaWarning)
            try:
                frames.append(len(read_fap(path, salvage=True)))
            except FbaError:
                assert not frames or frames[-1] == 0, "once there is a frame, salvage keeps it"
    assert frames == sorted(frames)
    assert frames[-1] == 3


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.binary(max_size=300)
    | st.text(max_size=300).map(str.encode)
    | st.lists(st.sampled_from(WORDS)).map(b" ".join)
)
@example(b"\xef\xbb\xbf")  # a byte order mark and nothing else
def test_anything_at_all(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "a.fap"
    path.write_bytes(data)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", FbaWarning)
        try:
            animation = read(path, fps=25) if data[:4] not in (b"\0\0\1\xba", b"\0\0\1\1") else None
            if animation is not None:
                write_fap(tmp_path / "b.fap", animation)
        except FbaError:
            pass
