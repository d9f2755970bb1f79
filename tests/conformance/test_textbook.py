"""The textbook arithmetic coder: worked by hand, against a dense model, and there and back."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fba import BitstreamError
from fba_conformance._textbook import FrequencyTable, decode_segment, encode_segment


def as_bytes(bits: str) -> bytes:
    bits += "0" * (-len(bits) % 8)
    return int("1" + bits, 2).to_bytes(len(bits) // 8 + 1, "big")[1:]


class DenseTable:
    """The model as the standard's text has it: a list with one count per symbol."""

    def __init__(self, size: int) -> None:
        self.counts = [1] * size

    def learn(self, symbol: int) -> None:
        if sum(self.counts) >= 16383:
            self.counts = [(count + 1) // 2 for count in self.counts]
        self.counts[symbol] += 1

    def cumulated(self, symbol: int) -> tuple[int, int]:
        return sum(self.counts[symbol:]), sum(self.counts[symbol + 1 :])


@pytest.mark.parametrize(
    ("symbols", "bits"),
    [
        ([], "01"),  # the flush alone
        ([0], "101"),  # symbol 0 has the upper half
        ([1], "001"),
        ([0, 1, 1, 0], "100101"),
        ([1] * 22, "0" * 22 + "101"),  # 22 zeros, then an inserted 1 before the flush
        ([1] * 21, "0" * 22 + "11"),  # the flush's 0 is the 22nd: an inserted 1 before its 1
        ([1] * 23, "0" * 22 + "1" + "0" + "01"),
        ([1] * 44, "0" * 22 + "1" + "0" * 22 + "1" + "01"),
    ],
)
def test_segments_worked_by_hand(symbols: list[int], bits: str) -> None:
    """Two equally likely symbols cost a bit each."""
    tables = [FrequencyTable(2) for _ in symbols]
    assert encode_segment(symbols, tables, learn=False) == bits
    segment = decode_segment(as_bytes(bits + "1" * 20), 0, tables, learn=False)
    assert list(segment.symbols) == symbols
    assert segment.bits == len(bits)
    assert segment.inserted == len(bits) - len(symbols) - 2


def test_counts_are_halved_at_16383() -> None:
    table = FrequencyTable(3)
    for symbol, times in ((0, 16000), (1, 380)):
        for _ in range(times):
            table.learn(symbol)
    assert table.total == 16383
    table.learn(2)  # 16001, 381, 1 become 8001, 191, 1, and then the last 2
    assert table.total == 8001 + 191 + 2
    assert [table.share(symbol) for symbol in range(3)] == [(8194, 193), (193, 2), (2, 0)]


@given(st.integers(1, 40), st.data())
def test_same_shares_as_a_dense_model(size: int, data: st.DataObject) -> None:
    sparse, dense = FrequencyTable(size), DenseTable(size)
    for symbol, times in data.draw(
        st.lists(st.tuples(st.integers(0, size - 1), st.sampled_from([1, 2, 50, 9000])), max_size=6)
    ):
        for _ in range(times):
            sparse.learn(symbol)
            dense.learn(symbol)
    assert sparse.total == sum(dense.counts)
    for symbol in range(size):
        above, below = dense.cumulated(symbol)
        assert sparse.share(symbol) == (above, below)
        assert sparse.find(above - 1) == (symbol, above, below)
        assert sparse.find(below) == (symbol, above, below)


SEGMENTS = st.lists(
    st.lists(
        st.sampled_from([1, 2, 3, 31, 3721]).flatmap(
            lambda size: st.tuples(st.just(size), st.sampled_from([0, size - 1, size // 2]))
        ),
        max_size=60,
    ),
    min_size=1,
    max_size=4,
)


@given(SEGMENTS, st.integers(0, 9), st.sampled_from(["", "0", "1"]), st.booleans())
def test_encoded_segments_are_decoded_again(
    segments: list[list[tuple[int, int]]], offset: int, behind: str, learn: bool
) -> None:
    """Segments one behind another, with anything before and behind them, zeros included."""
    coded = [
        encode_segment([s for _, s in pairs], [FrequencyTable(n) for n, _ in pairs], learn=learn)
        for pairs in segments
    ]
    data = as_bytes("1" * offset + "".join(coded) + behind * 50)
    bit = offset
    for pairs, bits in zip(segments, coded, strict=True):
        found = decode_segment(data, bit, [FrequencyTable(n) for n, _ in pairs], learn=learn)
        assert list(found.symbols) == [s for _, s in pairs]
        assert found.bits == len(bits)
        assert "0" * 23 not in bits
        bit += found.bits


def test_23_zeros_are_damage_at_the_last_of_them() -> None:
    with pytest.raises(BitstreamError, match="22 zero bits") as caught:
        decode_segment(as_bytes("111" + "0" * 40), 3, [FrequencyTable(2)] * 40, learn=False, plane=7)
    assert (caught.value.plane, caught.value.bit) == (7, 3 + 22)


def test_data_that_ends_inside_the_segment() -> None:
    with pytest.raises(BitstreamError, match="faces: starts at bit 0 and is not over") as caught:
        decode_segment(b"\xaa\xaa", 0, [FrequencyTable(2)] * 40, learn=False, name="faces")
    assert caught.value.bit == 16
