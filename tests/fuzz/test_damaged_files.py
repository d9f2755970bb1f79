"""Every reader and every kind of damage: an error of ours that names the file, or a result that holds.

The checks of `tools.fuzz` say what must hold of what was read. tests/fuzz/test_fuzz.py mutates bytes; here
each reader's files are cut and changed, and values of glTF documents replaced.
"""

import json
from collections.abc import Callable
from random import Random

import pytest

from fba.gltf._document import join_container, split_container
from json_places import spoil
from tools.fuzz import _engine as engine
from tools.fuzz.corpus import read_corpus
from tools.fuzz.targets import find_target, targets

READERS = [target.name for target in targets() if not (target.random or target.name.startswith("stream"))]


def cut(data: bytes, rng: Random) -> bytes:
    """Without its end."""
    return data[: rng.randrange(len(data))]


def changed(data: bytes, rng: Random) -> bytes:
    """With one to eight other bytes; of every second file only a part."""
    content = bytearray(data)
    for _ in range(rng.randint(1, 8)):
        content[rng.randrange(min(len(content), rng.choice([1500, len(content)])))] = rng.randrange(256)
    return bytes(content[: rng.randrange(1, len(data) + 1)]) if rng.random() < 0.5 else bytes(content)


def edited(data: bytes, rng: Random) -> bytes:
    """With one to three values of a glTF document replaced, removed or repeated, or bytes of its binary."""
    text, binary = split_container(data, "a.glb")
    root, blob = json.loads(bytes(text)), bytearray(binary or b"")
    for _ in range(rng.choice([1, 1, 2, 3])):
        if blob and rng.random() < 0.3:
            blob[rng.randrange(len(blob))] = rng.randrange(256)
            continue
        spoil(root, rng)
    return join_container(json.dumps(root).encode(), bytes(blob))


TABLE = [
    *((name, cut, 60) for name in READERS),
    *((name, changed, 120) for name in READERS),
    *((name, edited, 200) for name in ("face", "body", "gltf")),
]


@pytest.mark.parametrize(
    ("name", "damage", "count"), TABLE, ids=[f"{name}-{damage.__name__}" for name, damage, _ in TABLE]
)
def test_damage_is_an_error_of_ours_or_a_result_that_holds(
    name: str, damage: Callable[[bytes, Random], bytes], count: int
) -> None:
    target, rng = find_target(name), Random(len(name))
    files = [data for data in read_corpus(target) if data and (damage is not edited or data[:4] == b"glTF")]
    report = engine.run_files(target, [damage(files[n % len(files)], rng) for n in range(count)])
    assert not report.findings, report.findings[0].reason
    assert report.accepted + report.refused == count
    assert report.refused > 0 or name in ("live", "mtl")  # of which any beginning is read
    assert report.accepted > 10 or damage is not edited
