"""What other compressors take: bytes that their own decoders turn back into the numbers.

Errors of the study: worked out by hand for poses that are simple.
"""

import zlib

import numpy as np
import pytest

from bench.bitrate import rivals
from bench.bitrate.errors import measure_errors
from bench.bitrate.rivals import RIVALS, encode_varints
from fba.face import FaceModel

NUMBERS = np.array([[0, 5, -300], [1, 5, -300], [1, 5, 20000], [0, 4, 20000]], dtype=np.int64)


def read_varints(data: bytes) -> list[int]:
    """Signed integers as Protocol Buffers' sint64 are read."""
    found, value, shift = [], 0, 0
    for byte in data:
        value |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            found.append((value >> 1) ^ -(value & 1))
            value = shift = 0
    return found


@pytest.mark.parametrize(
    ("number", "data"),
    [(0, "00"), (-1, "01"), (1, "02"), (63, "7e"), (-64, "7f"), (64, "8001"), (150, "ac02"), (-300, "d704")],
)
def test_varints_are_those_of_protocol_buffers(number: int, data: str) -> None:
    assert encode_varints(np.array([number], dtype=np.int64)).tobytes().hex() == data


def test_varints_of_many_numbers_come_back() -> None:
    random = np.random.default_rng(2)
    numbers = (random.normal(0, 1, 500) * 10.0 ** random.integers(0, 9, 500)).astype(np.int64)
    assert read_varints(encode_varints(numbers).tobytes()) == numbers.tolist()


def sizes(name: str) -> tuple[int, list[int] | None]:
    (rival,) = [one for one in RIVALS if one.name == name]
    if rival.package:
        pytest.importorskip(rival.package)
    return rival.file(NUMBERS), None if rival.live is None else rival.live(NUMBERS).tolist()


def test_sizes_without_a_compressor_are_those_of_the_numbers() -> None:
    assert sizes("int16") == (24, [6, 6, 6, 6])
    # 0, 5, -300 take 1, 1 and 2 bytes; 20300 takes three
    assert sizes("varints of differences") == (4 + 3 + 5 + 3, [4, 3, 5, 3])


def test_flushed_frames_of_deflate_can_be_read_one_by_one() -> None:
    packets = [row.tobytes() for row in np.split(NUMBERS.astype(np.uint8), 4)]
    compressor = zlib.compressobj(9, wbits=-15)
    blocks = [compressor.compress(one) + compressor.flush(zlib.Z_SYNC_FLUSH) for one in packets]
    assert all(block.endswith(rivals.FLUSH_END) for block in blocks)
    decompressor = zlib.decompressobj(-15)
    assert [decompressor.decompress(block) for block in blocks] == packets
    size, live = sizes("deflate, rows")
    assert live is not None
    assert all(0 < one < 20 for one in live)
    assert size < sum(live) + 12


@pytest.mark.parametrize("name", [one.name for one in RIVALS])
def test_only_what_goes_frame_by_frame_has_a_live_form(name: str) -> None:
    _, live = sizes(name)
    assert (live is None) == ("columns" in name or "xz" in name)
    assert live is None or len(live) == len(NUMBERS)


def test_columns_of_equal_numbers_cost_nearly_nothing() -> None:
    """Where one column repeats another, a compressor of columns finds it, which FBA does not."""
    brotli = pytest.importorskip("brotli")
    random = np.random.default_rng(1)
    column = np.cumsum(random.integers(-9, 10, (400, 1)), axis=0)
    (rival,) = [one for one in RIVALS if one.name == "brotli 11, columns"]
    assert rival.file(np.hstack([column] * 8)) < rival.file(column) + 30
    assert len(brotli.decompress(rivals._brotli(rivals._columns(column)))) == 400


def test_a_root_that_is_elsewhere_moves_every_point_by_as_much() -> None:
    source, shown = np.zeros((2, 296)), np.zeros((2, 296))
    shown[1, 180:183] = [3, 4, 12]  # BAPs 181 to 183, millimetres
    errors = measure_errors("body", source, shown, 25.0)
    per_joint = errors.millimetres.reshape(2, -1)
    assert not per_joint[0].any()
    np.testing.assert_allclose(per_joint[1], 13.0, atol=1e-4)
    assert errors.units == 12


def test_a_joint_that_turns_moves_points_3_cm_off_it() -> None:
    source, shown = np.zeros((1, 296)), np.zeros((1, 296))
    shown[0, 0:1] = 10_000  # 0.1 rad of the pelvis and all above it, or of a leg
    errors = measure_errors("body", source, shown, 25.0).millimetres
    assert (errors == 0).any()  # what hangs elsewhere stays
    assert errors[errors > 0].min() == pytest.approx(2 * 30 * np.sin(0.05), rel=1e-4)  # the joint itself


def test_the_face_is_measured_in_the_frame_of_the_head() -> None:
    source, shown = np.zeros((3, 68)), np.zeros((3, 68))
    shown[1, 47] = 1745  # FAP 48, head_pitch: 0.01745 rad is one degree
    shown[2, 2] = 100  # FAP 3, open_jaw: the chin goes down by 100 / 1024 of the mouth-nose separation
    errors = measure_errors("face", source, shown, 25.0)
    chin = 1000 * 100 * FaceModel.default().fapu.MNS
    assert errors.millimetres[:2].tolist() == [0, 0]
    assert chin <= errors.millimetres[2] < 2 * chin  # the chin, and no vertex twice as far
    assert errors.degrees == pytest.approx(1.0, abs=1e-3)
    assert errors.units == 1745
