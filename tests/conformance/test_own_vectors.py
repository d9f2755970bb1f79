"""The vectors that come with fba: complete, reproducible, passed, and worth something."""

import io
import json
import zipfile
from collections import Counter
from hashlib import sha256
from pathlib import Path

import pytest

from fba_conformance._values import read_values
from fba_conformance.suite.archive import write_archive
from fba_conformance.suite.index import SHIPPED_VECTORS, Vector, read_vectors
from fba_conformance.suite.runner import check, expected_listing
from tools.vectors import broken, coverage
from tools.vectors.generate import Made, made_vectors, write_vectors

VECTORS = read_vectors()
LONG = {"valid/counts_halved.fba", "valid/bap_int32.fba", "valid/high_level_zeros.fba"}
"""What takes more planes than 20: counts that add up to 16383, steps to the ends of 32 bits, rare symbols."""
SHORT = {"valid/one_plane.fba"}


def files(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()
    }


@pytest.fixture(scope="module")
def made() -> list[Made]:
    return list(made_vectors())


def test_the_committed_vectors_are_those_that_the_generator_makes(made: list[Made], tmp_path: Path) -> None:
    assert write_vectors(tmp_path, made) == len(VECTORS)
    assert files(tmp_path) == files(SHIPPED_VECTORS)
    assert sum(map(len, files(SHIPPED_VECTORS).values())) < 200_000


def test_there_are_enough_of_them_each_with_a_line_that_says_what_it_tests() -> None:
    valid = [one for one in VECTORS if not one.damaged]
    damaged = [one for one in VECTORS if one.damaged]
    assert len(valid) >= 64
    assert len(damaged) >= 24
    said = [one.entry["tests"] for one in VECTORS]
    assert all(said)
    assert len(set(said)) == len(said)
    lengths = {one.name: one.entry["planes"] for one in valid}
    assert {name for name, planes in lengths.items() if planes > 20} == LONG
    assert {name for name, planes in lengths.items() if planes < 5} == SHORT


def test_the_readme_counts_them_by_group() -> None:
    lines = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8").splitlines()
    begin = lines.index("| group | vectors | what they test |") + 2
    rows = [line.split("|")[1:3] for line in lines[begin : lines.index("", begin)]]
    counts = Counter(one.group for one in VECTORS)
    assert {name.strip(): int(count) for name, count in rows} == counts
    assert [name.strip() for name, _ in rows] == list(counts)


def test_every_vector_passes() -> None:
    results = [check(vector) for vector in VECTORS]
    assert [result.line() for result in results if not result.exact] == []
    assert sum(result.encoded is True for result in results) >= 100


@pytest.mark.slow
def test_every_point_of_the_syntax_and_every_branch_of_the_decoder_is_reached() -> None:
    found = coverage.reached(VECTORS)
    assert coverage.gaps(found) == []
    assert len(found) > 3600
    assert found["FrequencyTable.learn: if self.total >= COUNT_LIMIT: yes"] == ["valid/counts_halved"]
    assert found["stuffing of 0 bits before the end of the object"] == ["valid/no_whole_byte"]
    assert [name for name in coverage.NOT_FOR_VECTORS if name not in found or found[name]] == []
    few = coverage.reached([one for one in VECTORS if one.group == "masks"])
    assert "bap_quant 5, steps visage" in coverage.gaps(few)


def named(name: str) -> Vector:
    return next(one for one in VECTORS if one.name == f"{name}.fba")


@pytest.mark.parametrize("mistake", broken.mistakes(), ids=lambda mistake: mistake.name)
def test_a_decoder_with_this_mistake_is_found(mistake: broken.Mistake) -> None:
    vector = named(mistake.found_by)
    assert broken.find(mistake, [(vector, expected_listing(vector))]) == [mistake.found_by]


def test_a_decoder_without_a_mistake_is_not_found() -> None:
    """What changes nothing, changed as the mistakes are."""
    none = broken.Mistake("none", "is right", "", "_textbook", "COUNT_LIMIT = 16383", "COUNT_LIMIT = 16383")
    vectors = [(one, expected_listing(one)) for one in VECTORS if one.group in {"masks", "damage"}]
    assert broken.find(none, vectors) == []


def test_the_zip_has_everything_and_always_the_same_bytes() -> None:
    written = [io.BytesIO(), io.BytesIO()]
    assert [write_archive(file, VECTORS) for file in written] == [len(VECTORS)] * 2
    assert written[0].getvalue() == written[1].getvalue()
    with zipfile.ZipFile(written[0]) as read:
        held = {info.filename.removeprefix("fba-conformance/"): read.read(info) for info in read.infolist()}
        assert {info.compress_type for info in read.infolist()} == {zipfile.ZIP_STORED}
    streams = {name: data for name, data in held.items() if name.endswith(".fba")}
    assert streams == {name: data for name, data in files(SHIPPED_VECTORS).items() if name.endswith(".fba")}
    assert json.loads(held["index.json"]) == json.loads((SHIPPED_VECTORS / "index.json").read_text())
    for line in held["SHA256SUMS"].decode().splitlines():
        digest, name = line.split("  ")
        assert sha256(held[name]).hexdigest() == digest
    for entry in json.loads(held["index.json"]):
        text = held[entry["stream"].replace(".fba", ".txt")]
        assert sha256(text).hexdigest() == entry["values"]  # sha256sum checks it, without Python
        assert read_values(text.decode()).digest() == entry["values"]
        assert entry["tests"] in held["README.txt"].decode()
