"""Archives: what their rows hold, plain readers, adding to them, interruptions, labels and sounds."""

import os
import signal
import subprocess
import sys
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

import archived
import fba
from fba import Animation
from fba.archive import (
    Archive,
    Coding,
    Outcome,
    describe_archive,
    extract,
    find_sources,
    for_each,
    label_by_table,
    make_archive,
    verify_archive,
)
from fba.codec import digest
from fba.errors import FormatError
from fba.face import FaceModel


def test_rows_hold_the_performances(takes: Path, archive: Path) -> None:
    performances = {one.name: one for one in Archive(archive)}
    assert sorted(performances) == sorted(archived.NAMES)
    both = performances["anna/joy/both"]
    assert both.stream == (takes / "anna/joy/both.fba").read_bytes()
    assert (both.subject, both.labels, both.bap_steps) == ("anna", {"emotion": "joy"}, "visage")
    assert (both.rate, both.frames, both.planes, both.face, both.body) == (25, 260, 260, True, True)
    assert both.start_frames == tuple(range(0, 260, 25))
    assert both.units["MNS"] == FaceModel.default().fapu.MNS
    talk = performances["anna/joy/talk"]
    assert talk.decode() == fba.read(takes / "anna/joy/talk.fap")  # every value is kept
    assert talk.start_frames[:3] == (0, 100, 200)  # 4 s
    walk = performances["ben/sad/walk"]
    np.testing.assert_array_equal(
        archived.body_of(walk.decode()).values, archived.body_of(fba.read(takes / "ben/sad/walk.bap")).values
    )
    assert walk.units == {}
    assert Archive(archive)["ben/sad/walk"] == walk
    assert describe_archive(Archive(archive))["labels"] == {"emotion": 2}
    assert [check.faults for check in verify_archive(archive)] == [()] * 4


def test_any_parquet_reader_reads_them(takes: Path, archive: Path) -> None:
    rows = [
        row for path in sorted(archive.glob("shard-*.parquet")) for row in pq.read_table(path).to_pylist()
    ]
    for row in rows:
        animation = fba.decode(row["stream"], bap_steps=row["bap_steps"])
        assert digest(animation) == row["digest"]
        assert (float(animation.rate), float(animation.duration)) == (row["rate"], row["seconds"])
        for frame, byte in zip(row["start_frames"], row["start_bytes"], strict=True):
            decoder = fba.Decoder(bap_steps=row["bap_steps"])
            first = (decoder.push(b"\0\0\1\xba" + row["stream"][byte:]))[0]
            if animation.face is not None:
                np.testing.assert_array_equal(first.face.values[0], animation.face.values[frame])
    assert [row["name"] for row in rows] == sorted(archived.NAMES)


def test_duckdb_reads_them(archive: Path) -> None:
    duckdb = pytest.importorskip("duckdb")
    found = duckdb.sql(
        f"select name, octet_length(stream), labels['emotion'], fapu.MW from '{archive}/shard-*.parquet' "
        "where subject = 'anna' and face order by name"
    ).fetchall()
    assert [row[0] for row in found] == ["anna/joy/both", "anna/joy/talk"]
    assert found[0][2] == "joy"
    assert found[0][3] == pytest.approx(FaceModel.default().fapu.MW)


def test_streams_are_encoded_again_where_asked(takes: Path, tmp_path: Path) -> None:
    archived.make(takes, tmp_path, coding=Coding(period=2))
    both = Archive(tmp_path)["anna/joy/both"]
    assert both.start_frames == tuple(range(0, 260, 50))
    whole = fba.read(takes / "anna/joy/both.fba")
    assert (both.decode().face, both.decode().body) == (whole.face, whole.body)


@pytest.mark.slow
def test_smaller_within_a_tolerance(tmp_path: Path) -> None:
    fba.write(tmp_path / "talk.fap", archived.performance(1, frames=40))
    sizes = []
    for coding in (Coding(), Coding(tolerance=0.002)):
        folder = tmp_path / str(len(sizes))
        archived.make(tmp_path / "talk.fap", folder, coding=coding)
        sizes.append(len(Archive(folder)["talk"].stream))
        assert [check.faults for check in verify_archive(folder)] == [()]
    assert sizes[1] < 0.9 * sizes[0]


def test_a_make_that_stops_goes_on_where_it_stopped(takes: Path, tmp_path: Path) -> None:
    sources = find_sources([takes])
    first = list(islice(make_archive(sources, tmp_path, shard_bytes=1), 2))
    assert [report.unchanged for report in first] == [False] * 2
    assert len(list(tmp_path.iterdir())) == 2  # whole shards, and no other file
    assert len(Archive(tmp_path)) == 2
    again = archived_reports(sources, tmp_path)
    assert sorted(again.items()) == [(name, name in archived.NAMES[:2]) for name in sorted(archived.NAMES)]
    assert sorted(one.name for one in Archive(tmp_path)) == sorted(archived.NAMES)
    assert all(archived_reports(sources, tmp_path).values())
    assert [path.name[:11] for path in sorted(tmp_path.iterdir())] == [
        "shard-00000",
        "shard-00001",
        "shard-00002",
    ]


def archived_reports(sources: Any, folder: Path) -> dict[str, bool]:
    """By name: whether a performance was there before."""
    return {report.source.name: report.unchanged for report in make_archive(sources, folder)}


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_a_make_that_is_killed_leaves_whole_shards(takes: Path, tmp_path: Path) -> None:
    script = (
        "import sys; from pathlib import Path; from fba.archive import *\n"
        "for report in make_archive(find_sources([Path(sys.argv[1])]), sys.argv[2], shard_bytes=1):\n"
        "    print(report.source.name, flush=True)\n"
        "    if report.source.name == 'anna/joy/talk': sys.stdin.read()"
    )
    command = [sys.executable, "-c", script, str(takes), str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert [process.stdout.readline().strip() for _ in range(2)] == list(archived.NAMES[:2])
        os.kill(process.pid, signal.SIGKILL)
    assert [check.faults for check in verify_archive(tmp_path)] == [()] * 2
    archived_reports(find_sources([takes]), tmp_path)
    assert sorted(one.name for one in Archive(tmp_path)) == sorted(archived.NAMES)


def test_other_content_under_a_name_is_reported(takes: Path, archive: Path, tmp_path: Path) -> None:
    archived.make(takes, tmp_path / "archive")
    (tmp_path / "takes").mkdir()
    target = archived.write_folder(tmp_path / "takes") / "anna/joy/talk.fap"
    fba.write(target, archived.performance(9))
    (target.parent / "more.fap").write_bytes(target.read_bytes())
    reports = {one.source.name: one for one in archived.make(tmp_path / "takes", tmp_path / "archive")}
    assert "the archive has another anna/joy/talk" in reports["anna/joy/talk"].error
    assert reports["ben/sad/walk"].unchanged
    assert len(Archive(tmp_path / "archive")) == 5


def test_files_that_cannot_be_read_are_reported(tmp_path: Path) -> None:
    (tmp_path / "takes").mkdir()
    fba.write(tmp_path / "takes" / "good.fap", archived.performance(1, frames=30))
    (tmp_path / "takes" / "cut.fba").write_bytes(fba.encode(archived.performance(1, frames=30))[:500])
    (tmp_path / "takes" / "empty.bap").write_bytes(b"")
    (tmp_path / "takes" / "notes.md").write_text("no animation")
    (tmp_path / "takes" / ".hidden.fap").write_text("no animation")
    reports = {one.source.shown: one.error for one in archived.make(tmp_path / "takes", tmp_path / "out")}
    assert sorted(reports) == ["cut.fba", "empty.bap", "good.fap"]
    assert reports["good.fap"] == ""
    assert "cut off" in reports["cut.fba"]
    assert "is empty" in reports["empty.bap"]
    assert [one.name for one in Archive(tmp_path / "out")] == ["good"]


def test_names_stay_apart(tmp_path: Path) -> None:
    for name in ("a/one.fap", "a/one.bap", "b/one.fap"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        face = name.endswith("fap")
        fba.write(tmp_path / name, archived.performance(1, face=face, body=not face, frames=5))
    names = [one.name for one in find_sources([tmp_path / "a", tmp_path / "b"])]
    assert names == ["a/one.bap", "a/one.fap", "b/one"]
    (tmp_path / "c" / "a").mkdir(parents=True)
    (tmp_path / "c" / "a" / "one.fap").write_bytes(b"x")
    with pytest.raises(FormatError, match=r"a/one.fap is there twice"):
        find_sources([tmp_path / "a", tmp_path / "c" / "a"])


def test_labels_of_a_table(takes: Path, tmp_path: Path) -> None:
    table = tmp_path / "labels.csv"
    table.write_text("file,subject,emotion,take\nanna/joy/talk.fap,Anna,,1\nben/sad/walk,,sad,2\n")
    sources = {one.name: one for one in label_by_table(find_sources([takes]), table)}
    assert (sources["anna/joy/talk"].subject, sources["anna/joy/talk"].labels) == ("Anna", {"take": "1"})
    assert (sources["ben/sad/walk"].subject, sources["ben/sad/walk"].labels) == (
        None, {"emotion": "sad", "take": "2"},
    )  # fmt: skip


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name,subject\na,b\n", "no column `file`"),
        ("", "is empty"),
        ("file,file\na,b\n", "two of its columns"),
        ("file,a\nanna/joy/tolk,1\n", r":2: names a file that is not there \(did you mean 'anna/joy/talk'"),
        ("file,a\nanna/joy/talk,1\nanna/joy/talk.fap,2\n", ":3: names a file that line 2 names"),
        ("file,a\nanna/joy/talk\n", ":2: has 1 cells; the first line names 2"),
        ("file\n\0\n", "zero bytes"),
    ],
)
def test_tables_that_do_not_fit(takes: Path, tmp_path: Path, text: str, message: str) -> None:
    table = tmp_path / "labels.csv"
    table.write_text(text)
    with pytest.raises(FormatError, match=message) as raised:
        label_by_table(find_sources([takes]), table)
    assert raised.value.path == str(table)


def test_sounds_by_name_and_inside(tmp_path: Path) -> None:
    (tmp_path / "takes").mkdir()
    fba.write(tmp_path / "takes" / "one.fap", archived.performance(1, frames=30))
    (tmp_path / "takes" / "one.wav").write_bytes(b"RIFF sound")
    found = {}
    for sound in ("none", "reference", "inside"):
        archived.make(tmp_path / "takes", tmp_path / sound, sound=sound)
        one = Archive(tmp_path / sound)["one"]
        found[sound] = one.sound_name, one.sound
    assert found == {
        "none": (None, None),
        "reference": ("one.wav", None),
        "inside": ("one.wav", b"RIFF sound"),
    }
    written = list(extract(Archive(tmp_path / "inside"), ["one"], tmp_path / "back"))
    assert [path.name for path in written] == ["one.fba", "one.wav"]
    assert written[1].read_bytes() == b"RIFF sound"


def test_extracted_streams_are_the_same(takes: Path, archive: Path, tmp_path: Path) -> None:
    written = list(extract(Archive(archive), [], tmp_path))
    assert [path.relative_to(tmp_path).as_posix() for path in written] == [
        f"{name}.fba" for name in archived.NAMES
    ]
    assert written[0].read_bytes() == (takes / "anna/joy/both.fba").read_bytes()
    with pytest.raises(FormatError, match=r"has no performance 'anna/joy/tolk' \(did you mean"):
        list(extract(Archive(archive), ["anna/joy/tolk"], tmp_path))


def test_several_processes_make_the_same(takes: Path, archive: Path, tmp_path: Path) -> None:
    archived.make(takes, tmp_path, jobs=2)
    assert list(Archive(tmp_path)) == list(Archive(archive))


def work(item: int) -> int:
    if item == 7:
        os._exit(9)  # as the system ends a process that takes too much memory
    if item == 11:
        raise FormatError("eleven")
    if item == 13:
        raise MemoryError
    return item * item


@pytest.mark.slow
def test_a_process_that_dies_takes_its_item_alone() -> None:
    outcomes = list(for_each(work, range(20), jobs=2, chunk=4))
    assert [one.item for one in outcomes] == list(range(20))  # nothing lost, nothing twice
    failed = {one.item: one.error for one in outcomes if one.error}
    assert sorted(failed) == [7, 11, 13]
    assert "was ended; is the memory full?" in failed[7]
    assert (failed[11], failed[13]) == ("eleven", "not enough memory for it")
    assert outcomes[19] == Outcome(19, 361)


def test_a_stream_of_several_objects_is_decoded_from_its_beginning(tmp_path: Path) -> None:
    parts = [archived.performance(seed, frames=60) for seed in (1, 2)]
    (tmp_path / "takes").mkdir()
    options = fba.EncoderOptions(intra_period=1, start_codes=True, time_codes=False)
    parts = [replace(part, index=np.arange(60)) for part in parts]
    (tmp_path / "takes" / "two.fba").write_bytes(b"".join(fba.encode(part, options) for part in parts))
    archived.make(tmp_path / "takes", tmp_path / "out")
    two = Archive(tmp_path / "out")["two"]
    assert two.start_frames == (0,)
    whole = fba.read(tmp_path / "takes" / "two.fba")
    part = two.decode_frames(70, 80)
    assert isinstance(part, Animation)
    assert part.face == whole.face
    assert [check.faults for check in verify_archive(tmp_path / "out")] == [()]
