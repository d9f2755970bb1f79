"""The index of an archive: figures against counts by hand; queries, and text that must do no harm."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import archived
import fba
from fba import Animation, BodyTrack, FaceTrack, emotion
from fba.archive import Windows, index_archive, query
from fba.errors import FbaWarning, FormatError, OptionError
from fba.parameters import bap_numbers, fap_numbers

pytest.importorskip("duckdb")


def face(rows: dict[str, np.ndarray]) -> Animation:
    count = len(next(iter(rows.values())))
    values = np.zeros((count, 68), np.int32)
    mask = np.zeros((count, 68), bool)
    for name, row in rows.items():
        values[:, fap_numbers()[name] - 1] = row
        mask[:, fap_numbers()[name] - 1] = True
    return Animation(25, np.arange(count), FaceTrack(values, mask))


def blinking() -> Animation:
    """Ten seconds: seven blinks of five frames, and two seconds of shut lids, which is none."""
    lids = np.zeros(250, np.int32)
    for first in range(10, 10 + 7 * 20, 20):
        lids[first : first + 5] = 900
    lids[180:230] = 900
    jaw = np.arange(250) % 8 * 20
    return face({"close_t_l_eyelid": lids, "close_t_r_eyelid": lids, "open_jaw": jaw})


def doubtful() -> Animation:
    """Four seconds: a jump at frame 20, 40 frozen frames from 50 on, a jaw beyond the table in three."""
    jaw = np.arange(100) % 5 * 30
    jaw[50:90] = jaw[49]
    jaw[95:98] = 5000
    turn = np.where(np.arange(100) < 20, 0, 170000)
    return face({"open_jaw": jaw, "head_yaw": turn})


@pytest.fixture(scope="module")
def indexed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("indexed")
    (root / "takes" / "anna" / "rest").mkdir(parents=True)
    fba.write(root / "takes/anna/rest/blinking.fap", blinking())
    fba.write(root / "takes/anna/doubtful.fap", doubtful())
    joyful = emotion.animate(emotion.combine({"joy": 80}), seconds=4, rate=25, send="faps")
    fba.write(root / "takes/joyful.fap", joyful)
    turns = np.zeros((50, 296), np.int32)
    turns[:, bap_numbers()["l_elbow_flexion"] - 1] = np.linspace(0, 300000, 50).astype(int)
    body = BodyTrack(turns, np.broadcast_to(turns.any(axis=0), turns.shape))
    fba.write(root / "takes/body.bap", Animation(25, np.arange(50), None, body))
    assert [one.error for one in archived.make(root / "takes", root / "archive")] == [""] * 4
    assert sorted(one.name for one in index_archive(root / "archive")) == [
        "anna/doubtful", "anna/rest/blinking", "body", "joyful",
    ]  # fmt: skip
    return root / "archive"


def row(folder: Path, name: str) -> dict[str, Any]:
    (found,) = query(folder, f"name = '{name}'").to_pylist()
    return dict(found)


def test_figures(indexed: Path) -> None:
    blinks = row(indexed, "anna/rest/blinking")
    assert (blinks["blinks"], blinks["seconds"], blinks["rate"], blinks["frames"]) == (7, 10.0, 25.0, 250)
    assert (blinks["subject"], blinks["labels"]) == ("anna", [("emotion", "rest")])
    motion = dict(blinks["motion"])
    assert motion["open_jaw"] == pytest.approx(np.std(np.arange(250) % 8 * 20))
    assert sorted(motion) == sorted(dict.fromkeys([*motion]))
    assert {"close_t_l_eyelid", "close_t_r_eyelid"} <= set(motion)
    bits = dict(blinks["bits"])
    assert set(bits) == {"face jaw, chin, inner lip, lip corners", "face eyeballs, pupils, eyelids"}
    assert 0.7 < sum(bits.values()) / blinks["bits_per_second"] < 1.5
    joyful = row(indexed, "joyful")
    assert joyful["emotion"] == "joy"
    assert dict(joyful["emotions"])["joy"] > 0.5
    assert sum(dict(joyful["emotions"]).values()) == pytest.approx(1)


def test_doubtful_frames(indexed: Path) -> None:
    found = row(indexed, "anna/doubtful")
    assert (found["limit_frames"], found["frozen_frames"]) == (3, 40)
    assert {"kind": "jump", "frame": 20, "frames": 1} in found["doubtful"]  # 97 degrees in a frame
    assert {"kind": "frozen", "frame": 50, "frames": 40} in found["doubtful"]
    body = row(indexed, "body")
    assert (body["blinks"], body["emotion"]) == (None, None)
    assert body["limit_frames"] > 0  # an elbow bends by 172 degrees at the end
    assert body["jump_frames"] == 0


def test_conditions_columns_and_order(indexed: Path) -> None:
    names = query(indexed, "blinks > 5 and seconds < 60", columns=["name"]).to_pylist()
    assert names == [{"name": "anna/rest/blinking"}]
    assert query(indexed, "labels['emotion'] = 'rest'").num_rows == 1
    assert query(indexed, "motion['open_jaw'] > 10", columns=["name"]).num_rows == 2
    table = query(indexed, "face", columns=["name", "seconds"], sort="-seconds", limit=2)
    assert table.column_names == ["name", "seconds"]
    assert table.column("seconds").to_pylist() == [10.0, 4.0]
    assert query(indexed, "-- nothing but a remark\ntrue").num_rows == 4
    chosen = query(indexed, "blinks > 5")["name"].to_pylist()
    assert len(Windows(indexed, 50, performances=chosen)) == 5


def test_an_index_grows_with_its_archive(indexed: Path, tmp_path: Path) -> None:
    takes = tmp_path / "takes"
    takes.mkdir()
    fba.write(takes / "one.fap", archived.performance(1, frames=30))
    archived.make(takes, tmp_path / "out")
    with pytest.raises(FormatError, match="has no index yet; make one with `fba archive index`"):
        query(tmp_path / "out")
    assert [one.name for one in index_archive(tmp_path / "out")] == ["one"]
    fba.write(takes / "two.fap", archived.performance(2, frames=30))
    archived.make(takes, tmp_path / "out")
    with pytest.warns(FbaWarning, match="the index lacks 1 performances"):
        assert query(tmp_path / "out").num_rows == 1
    assert [one.name for one in index_archive(tmp_path / "out")] == ["two"]
    assert query(tmp_path / "out", columns=["name"]).to_pylist() == [{"name": "one"}, {"name": "two"}]


HOSTILE = [
    "1=1); COPY performances TO '{folder}/stolen.csv'; SELECT (1",
    "true) ; ATTACH '{folder}/stolen.db'; SELECT (1",
    "true); INSTALL httpfs; SELECT (true",
    "true); SET enable_external_access = true; SELECT (true",
    "exists (select * from read_text('{folder}/secret.txt'))",
    "exists (select * from read_csv('{folder}/secret.txt'))",
    "exists (select * from read_parquet('{folder}/index.parquet'))",
    "exists (select * from '{folder}/secret.txt')",
    "exists (select * from glob('{folder}/*'))",
    "exists (select * from table_of_the_caller)",
    "getenv('HOME') = ''",
    "name in (select content from read_blob('{folder}/secret.txt'))",
    "(select count(*) from range(1000000000000) a, range(1000000000) b) > 0",
    "len(repeat('x', 1000000000000)) > 0",
    "list_sum(range(100000000000)) > 0",
    "blinks >",
    "blnks > 3",
    "'unclosed",
    "",
    "\0",
]


@pytest.mark.parametrize("condition", HOSTILE)
def test_text_that_must_do_no_harm(
    indexed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, condition: str
) -> None:
    import pyarrow as pa

    monkeypatch.setattr("fba.archive._index.QUERY_SECONDS", 1.0)
    table_of_the_caller = pa.table({"a": [1]})
    (tmp_path / "index.parquet").write_bytes((indexed / "index.parquet").read_bytes())
    (shard,) = indexed.glob("shard-*")
    (tmp_path / shard.name).write_bytes(shard.read_bytes())
    (tmp_path / "secret.txt").write_text("secret")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(OptionError) as raised:
        query(tmp_path, condition.format(folder=tmp_path))
    assert "condition" in str(raised.value) or "query" in str(raised.value)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    assert table_of_the_caller.num_rows == 1


def test_columns_that_are_not_there(indexed: Path) -> None:
    with pytest.raises(OptionError, match=r"no column 'blink' \(did you mean 'blinks'"):
        query(indexed, columns=["blink"])
    with pytest.raises(OptionError, match="no column"):
        query(indexed, sort='name"; DROP TABLE performances; --')


@pytest.mark.parametrize("content", [b"", b"PAR1", b"hello"])
def test_an_index_that_is_none(indexed: Path, tmp_path: Path, content: bytes) -> None:
    (shard,) = indexed.glob("shard-*")
    (tmp_path / shard.name).write_bytes(shard.read_bytes())
    (tmp_path / "index.parquet").write_bytes(content)
    with pytest.raises(FormatError, match="is damaged, or no Parquet file"):
        query(tmp_path)
    (tmp_path / "index.parquet").write_bytes(shard.read_bytes())
    with pytest.raises(FormatError, match=r"is no index of this program's version; delete it"):
        query(tmp_path)
