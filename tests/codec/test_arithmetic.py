"""The compiled arithmetic coder against the textbook's, in both directions."""

from random import Random

import numpy as np
import pytest

from fba import BitstreamError
from fba.codec._plane.arithmetic import (
    BAD_FLUSH,
    BAD_GUARD,
    OK,
    OUT_OF_DATA,
    STRIDE,
    TOTAL_MAX,
    Counts,
    decode_segment,
    encode_segment,
    learn,
)
from fba_conformance import _textbook as textbook

SIZES = (1, 2, 2, 3, 7, 63, 127, 720, 3721, 3721)


class Coder:
    """Models of the compiled coder and of the textbook, side by side."""

    def __init__(self, sizes: tuple[int, ...], usual: tuple[int, ...] | None = None) -> None:
        self.sizes = sizes
        size = np.array(sizes, dtype=np.int64)
        usual_symbols = np.array(usual or [one // 2 for one in sizes], dtype=np.int64)
        none = np.zeros((len(sizes), STRIDE), dtype=np.uint16)
        self.models = Counts(size, usual_symbols, size.copy(), usual_symbols.copy(), none, none.copy())
        self.tables = [textbook.FrequencyTable(one) for one in sizes]

    def learn(self, slots: list[int], symbols: list[int]) -> None:
        learn(np.array(slots, dtype=np.int64), np.array(symbols, dtype=np.int64), self.models)
        for slot, symbol in zip(slots, symbols, strict=True):
            self.tables[slot].learn(symbol)

    def encode(self, slots: list[int], symbols: list[int], offset: int = 0, adaptive: bool = True) -> str:
        data = np.zeros(8 + 3 * len(slots) + offset // 8, dtype=np.uint8)
        bit = encode_segment(
            data,
            offset,
            np.array(slots, dtype=np.int64),
            self.models,
            adaptive,
            np.array(symbols, dtype=np.int64),
        )
        assert not data[(bit >> 3) + 1 :].any()
        return "".join(f"{byte:08b}" for byte in data)[offset:bit]

    def decode(
        self, data: bytes, bit: int, slots: list[int], adaptive: bool = True
    ) -> tuple[int, int, list[int]]:
        symbols = np.full(len(slots), -1, dtype=np.int64)
        status, after = decode_segment(
            np.frombuffer(bytearray(data), dtype=np.uint8),
            bit,
            8 * len(data),
            np.array(slots, dtype=np.int64),
            self.models,
            adaptive,
            symbols,
        )
        return status, after, symbols.tolist()


def as_bytes(bits: str) -> bytes:
    bits += "0" * (-len(bits) % 8)
    return int("1" + bits, 2).to_bytes(len(bits) // 8 + 1, "big")[1:]


def likely(random: Random, size: int) -> int:
    """Symbols as codecs send them: mostly no change, sometimes an end of the alphabet, or any."""
    kind = random.random()
    if kind < 0.5:
        return size // 2
    return random.choice((0, size - 1)) if kind < 0.75 else random.randrange(size)


def test_20000_random_segments() -> None:
    """Same bits as the textbook makes, same symbols and end as it reads, whatever stands around them."""
    random = Random(1)
    coder = Coder(SIZES)
    for number in range(20_000):
        count = random.choice((0, 1, 1, 2, 3, 5))
        slots = random.sample(range(len(SIZES)), count)
        symbols = [likely(random, SIZES[slot]) for slot in slots]
        tables = [coder.tables[slot] for slot in slots]
        adaptive = number % 4 != 0
        if not adaptive:
            tables = [textbook.FrequencyTable(SIZES[slot]) for slot in slots]
        bits = textbook.encode_segment(symbols, tables, learn=False)
        offset = random.randrange(8)
        assert coder.encode(slots, symbols, offset, adaptive) == bits
        around = random.choice(("1" * 40, "0" * 40, f"{random.getrandbits(40):040b}"))
        data = as_bytes("1" * offset + bits + around)
        assert coder.decode(data, offset, slots, adaptive) == (OK, offset + len(bits), symbols)
        if adaptive:
            coder.learn(slots, symbols)


@pytest.mark.parametrize("seed", range(4))
def test_long_histories(seed: int) -> None:
    """Segments of all models at once; in the end every count is that of the textbook."""
    random = Random(seed)
    sizes = tuple(random.choice((1, 2, 3, 31, 121, 3721)) for _ in range(12))
    coder = Coder(sizes, tuple(random.randrange(size) for size in sizes))
    slots = list(range(len(sizes)))
    for _ in range(150):
        symbols = [likely(random, size) for size in sizes]
        bits = textbook.encode_segment(symbols, [coder.tables[slot] for slot in slots], learn=False)
        assert coder.encode(slots, symbols) == bits
        assert coder.decode(as_bytes(bits), 0, slots) == (OK, len(bits), symbols)
        coder.learn(slots, symbols)
    for slot, size in enumerate(sizes):
        counts = 1 + coder.models.added[slot, :size].astype(int)
        above = np.append(np.cumsum(counts[::-1])[::-1], 0)
        for symbol in {0, size - 1, size // 2, *(random.randrange(size) for _ in range(20))}:
            assert coder.tables[slot].share(symbol) == (above[symbol], above[symbol + 1])
        assert coder.models.total[slot] == coder.tables[slot].total


@pytest.mark.parametrize(("size", "usual"), [(2, 0), (3, 1), (3721, 1860), (16, 15)])
def test_counts_are_halved_at_16383(size: int, usual: int) -> None:
    """Through two halvings; shares and bits stay those of the textbook."""
    random = Random(size)
    coder = Coder((size,), (usual,))
    halvings, before = 0, size
    for _ in range(2 * TOTAL_MAX):
        coder.learn([0], [likely(random, size)])
        total = int(coder.models.total[0])
        assert total <= TOTAL_MAX
        halvings += total < before
        if total < before or total == TOTAL_MAX:
            symbol = likely(random, size)
            bits = textbook.encode_segment([symbol], coder.tables, learn=False)
            assert coder.encode([0], [symbol]) == bits
            assert coder.decode(as_bytes(bits), 0, [0]) == (OK, len(bits), [symbol])
        assert total == coder.tables[0].total
        before = total
    assert halvings >= 2


@pytest.mark.parametrize("count", [20, 21, 22, 23, 43, 44, 45, 100, 1000])
@pytest.mark.parametrize("behind", ["", "0" * 40, "1" * 40])
def test_runs_of_zeros(count: int, behind: str) -> None:
    """Symbol 1 of two is a 0: after 22 a 1 is slipped in, so that 23 never stand in a row."""
    coder = Coder((2,))
    slots, symbols = [0] * count, [1] * count
    bits = coder.encode(slots, symbols, adaptive=False)
    assert "0" * 23 not in bits
    assert bits.startswith(("0" * 22 + "1")[:count])
    assert bits == textbook.encode_segment(symbols, [textbook.FrequencyTable(2)] * count, learn=False)
    assert coder.decode(as_bytes(bits + behind), 0, slots, adaptive=False) == (OK, len(bits), symbols)


def test_an_empty_segment_is_two_bits() -> None:
    coder = Coder((2,))
    assert coder.encode([], []) == "01"
    assert coder.decode(as_bytes("01" + "0" * 30), 0, []) == (OK, 2, [])
    for wrong in ("00", "10", "11"):
        assert coder.decode(as_bytes(wrong + "1" * 30), 0, [])[:2] == (BAD_FLUSH, 0)


def test_alphabets_of_one_symbol_cost_nothing() -> None:
    coder = Coder((1, 1, 1))
    assert coder.encode([0, 1, 2], [0, 0, 0]) == "01"
    assert coder.decode(as_bytes("01"), 0, [0, 1, 2]) == (OK, 2, [0, 0, 0])


def test_23_zeros_are_damage_if_the_inserted_1_is_missing() -> None:
    coder = Coder((2,))
    status, bit, _ = coder.decode(as_bytes("111" + "0" * 61), 3, [0] * 40, adaptive=False)
    assert (status, bit) == (BAD_GUARD, 3 + 22)


def test_data_that_ends_inside() -> None:
    coder = Coder((2,))
    bits = coder.encode([0] * 38, [0, 1] * 19, adaptive=False)
    assert len(bits) == 40
    for length in range(5):
        assert coder.decode(as_bytes(bits)[:length], 0, [0] * 38, adaptive=False)[:2] == (
            OUT_OF_DATA,
            8 * length,
        )


def test_random_bits_as_the_textbook_reads_them() -> None:
    """Symbols and length, or damage of the same kind at the same place."""
    random = Random(3)
    coder = Coder(SIZES)
    for _ in range(300):
        slots = random.sample(range(len(SIZES)), 4)
        coder.learn(slots, [likely(random, SIZES[slot]) for slot in slots])
    seen = dict.fromkeys((OK, OUT_OF_DATA, BAD_GUARD, BAD_FLUSH), 0)
    for _ in range(6000):
        slots = [random.randrange(len(SIZES)) for _ in range(random.randrange(9))]
        length = random.randrange(1, 16)
        data = bytes(random.choice((0, 0, 1, 255, random.randrange(256))) for _ in range(length))
        bit = random.randrange(8)
        status, after, symbols = coder.decode(data, bit, slots)
        seen[status] += 1
        try:
            segment = textbook.decode_segment(data, bit, [coder.tables[s] for s in slots], learn=False)
        except BitstreamError as error:
            message, place = str(error), error.bit
            segment = None
        if segment is not None:
            assert (status, after, symbols) == (OK, bit + segment.bits, list(segment.symbols))
        else:
            text = {
                OUT_OF_DATA: "not over where the data ends",
                BAD_GUARD: "22 zero bits",
                BAD_FLUSH: "flushes",
            }
            assert text[status] in message or status == OUT_OF_DATA
            if text[status] in message:
                assert after == place
    assert all(count > 50 for count in seen.values()), seen


@pytest.mark.parametrize("adaptive", [True, False])
@pytest.mark.parametrize(
    ("slots", "symbols", "room", "message"),
    [
        ([4], [7], 16, "a symbol beyond its model"),
        ([0, 4], [0, 3721], 16, "a symbol beyond its model"),
        ([3], [-1], 16, "a symbol beyond its model"),
        ([0, 1, 2], [0, 0], 16, "a segment beyond its arrays"),
        ([8] * 8, [5] * 8, 16, "a segment beyond its arrays"),
        ([], [], 1, "a segment beyond its arrays"),
    ],
)
def test_writing_past_the_end_of_an_array_is_refused(
    slots: list[int], symbols: list[int], room: int, message: str, adaptive: bool
) -> None:
    models, data = Coder(SIZES).models, np.zeros(64, dtype=np.uint8)
    arrays = np.array(slots, dtype=np.int64), np.array(symbols, dtype=np.int64)
    with pytest.raises(IndexError, match=message):
        encode_segment(data[:room], 0, arrays[0], models, adaptive, arrays[1])
    assert not data[room:].any()
    assert encode_segment(data, 0, arrays[0][:0], models, adaptive, arrays[1]) == 2


@pytest.mark.parametrize(("slots", "symbols"), [([4], [7]), ([3], [-1]), ([0, 1], [0])])
def test_symbols_beyond_their_models_are_not_learnt(slots: list[int], symbols: list[int]) -> None:
    models = Coder(SIZES).models
    with pytest.raises(IndexError, match="beyond"):
        learn(np.array(slots, dtype=np.int64), np.array(symbols, dtype=np.int64), models)
    assert not models.added[slots[0], 1:].any()


def test_a_segment_is_not_decoded_beyond_its_arrays() -> None:
    models, data, slots = Coder(SIZES).models, np.zeros(4, dtype=np.uint8), np.arange(2)
    for end, count in ((33, 2), (32, 1)):
        with pytest.raises(IndexError, match="a segment beyond its arrays"):
            decode_segment(data, 0, end, slots, models, True, np.zeros(count, dtype=np.int64))


@pytest.mark.parametrize("adaptive", [True, False])
def test_the_longest_segments_fit_the_required_room(adaptive: bool) -> None:
    """16 bits for each symbol and 16 more: rare symbols of the largest models, and zeros that are guarded."""
    coder = Coder((3721, 3721, 2), (0, 3720, 0))
    for _ in range(TOTAL_MAX - 3722):
        coder.learn([0, 1, 2], [0, 3720, 0])
    random = Random(3)
    for count in (1, 2, 50, 400):
        slots = [random.randrange(3) for _ in range(count)]
        symbols = [(3720, 0, 1)[slot] if random.random() < 0.9 else 1 for slot in slots]
        data = np.zeros(2 * (count + 1), dtype=np.uint8)
        end = encode_segment(
            data,
            0,
            np.array(slots, dtype=np.int64),
            coder.models,
            adaptive,
            np.array(symbols, dtype=np.int64),
        )
        assert end < 16 * count + 4
