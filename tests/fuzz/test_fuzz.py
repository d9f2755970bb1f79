"""The fuzzer: it finds what is wrong, says how to repeat it, and finds nothing in a few hundred inputs.

`./dev fuzz` and the fuzz stage of `.ci/run` try many more.
"""

import ast
import io
import json
import os
import re
import runpy
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from random import Random

import numpy as np
import pytest

from fba.codec._plane.pricing import NextPlane
from fba.errors import FbaError, OptionError
from fba.face.importers import KINDS as HEADS
from fba.face.importers import sniff
from fba.formats._registry import format_of, formats
from fba.live import KINDS
from tools.fuzz import __main__ as program
from tools.fuzz import _campaign as campaign
from tools.fuzz import _engine as engine
from tools.fuzz import _guided as guided
from tools.fuzz import _stream_contract as contract
from tools.fuzz._minimise import minimise
from tools.fuzz._mutation import mutate
from tools.fuzz._outcome import ContractError, Outcome
from tools.fuzz.corpus import CHECKOUT, read_corpus
from tools.fuzz.small_streams import small_streams
from tools.fuzz.targets import Target, find_target, targets

SEED = 20_000
READERS = [target.name for target in targets() if not (target.random or target.name.startswith("stream"))]
PERFORMANCES = [target.name for target in targets() if target.random]
OWN = "fuzzed_functions"
"""Module with the functions below, for processes that the fuzzer starts."""
FUNCTIONS = """
import os, time
from tools.fuzz._outcome import Outcome

def crashes(data, folder):
    if b"{" in data:
        os.abort()
    return Outcome(True)

def raises(data, folder):
    if data.count(b"e") > 3:
        raise KeyError("four times e")
    return Outcome(True)
"""


def test_mutated_streams() -> None:
    streams = list(small_streams().values())
    report = engine.run(find_target("stream"), streams, count=120, seed=SEED)
    assert not report.findings, report.findings[0].reason
    assert report.accepted + report.refused == report.count == 120 + len(streams)
    assert min(report.accepted, report.salvaged) > 12  # the mutations reach all kinds of ends
    assert report.planes > 500


@pytest.mark.parametrize("name", READERS)
def test_mutated_files(name: str) -> None:
    target = find_target(name)
    corpus = read_corpus(target)
    report = engine.run(target, corpus, count=40 if len(corpus) > 3 else 100, seed=SEED)
    assert not report.findings, report.findings[0].reason
    unchanged = engine.run_files(target, corpus).accepted
    assert report.accepted > unchanged  # mutated files, too, are read to their ends
    assert report.refused > 5


@pytest.mark.parametrize("name", [*(name for name in READERS if name != "any"), "stream"])
def test_mutations_start_from_files_that_are_read(name: str) -> None:
    target = find_target(name)
    report = engine.run_files(target, read_corpus(target))
    damaged = 2 if name == "stream" else 0  # two of its files have checks that are not those of their planes
    assert (report.refused, report.findings) == (damaged, [])


@pytest.mark.parametrize("name", PERFORMANCES)
def test_random_performances(name: str) -> None:
    target = find_target(name)
    report = engine.run(target, read_corpus(target), count=12, seed=SEED)
    assert not report.findings, report.findings[0].reason
    assert report.count == 13
    assert report.accepted > 6
    assert engine.mutated(target, [], SEED, 5) != engine.mutated(target, [], SEED, 6)


def test_a_trial_that_counts_other_bits_is_a_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    true_bits = NextPlane.bits
    monkeypatch.setattr(NextPlane, "bits", lambda *arguments: true_bits(*arguments) + 2)
    kinds = set()
    for name in PERFORMANCES:
        report = engine.run(find_target(name), [], count=20, seed=SEED)
        kinds |= {finding.kind for finding in report.findings}
    assert kinds
    assert all(kind.startswith("ContractError: the planes take other bits than counted") for kind in kinds)


IN_CORPUS = [(target, data) for target in targets() if target.name != "any" for data in read_corpus(target)]


def test_every_format_has_a_file_in_the_corpus(tmp_path: Path) -> None:
    """Each format that is read, each kind of head that is imported, and each kind of live capture."""
    seen = set()
    for target, data in IN_CORPUS:
        path = tmp_path / ("a.wfm" if data.startswith(b"# VERTEX") else "a")
        path.write_bytes(data)
        with suppress(FbaError):
            seen.add(format_of(path).name)
        if target.name == "import":
            seen.add(f"head: {sniff(path)}")
        if target.name == "live":
            seen.add(f"live: {KINDS[data[0]].name}")
    wanted = {one.name for one in formats() if one.name != "vrma"}  # it is read as glTF
    wanted |= {f"head: {kind}" for kind in HEADS if kind not in ("makehuman", "shapes")}  # folders
    wanted |= {f"live: {kind.name}" for kind in KINDS}
    assert seen >= wanted
    assert any(b"VRMC_vrm_animation" in data for _, data in IN_CORPUS)


READING = {
    "fap": ("fba.formats.text.fap", "fba.formats.text._frame_reader"),
    "bap": ("fba.formats.text.bap", "fba.formats.text._frame_reader"),
    "epf": ("fba.formats.epf._reader",),
    "bvh": ("fba.formats.bvh._reader",),
    "gltf": (
        "fba.gltf._reader", "fba.gltf._nodes", "fba.formats.gltf._reader", "fba.formats.gltf._face_motion",
    ),
    "capture": (
        "fba.formats.c3d._reader", "fba.formats.c3d._parameters", "fba.formats.markers._motive",
        "fba.formats.markers._nexus", "fba.formats.markers._qualisys", "fba.formats.markers._table",
        "fba.formats.markers._trc", "fba.formats.face_tables._livelink_csv",
        "fba.formats.face_tables.livelink_udp", "fba.formats.face_tables.ifacialmocap",
        "fba.formats.face_tables._openface", "fba.formats.face_tables._pyfeat",
        "fba.formats.face_tables._shapes_json", "fba.formats.face_tables._points_arrays",
        "fba.formats.face_tables._points_csv", "fba.formats.face_tables._points_json",
    ),
    "smpl": ("fba.formats.smpl._reader", "fba.formats.zip_files"),
    "arf": (
        "fba.carriage.avatar_units", "fba.formats.avatar._reader", "fba.formats.avatar._container",
    ),
    "outlines": ("fba.outlines._index_file",),
    "persona": ("fba.persona._persona", "fba.persona.recognition._archive"),
    "live": (
        "fba.live._protocols.livelink", "fba.live._protocols.ifacialmocap", "fba.live._protocols.vtube",
        "fba.live._protocols.vmc",
    ),
    "face": ("fba.face.gltf._reading",),
    "body": ("fba.body._storage",),
    "obj": ("fba.mesh._obj",),
    "mtl": ("fba.mesh._materials",),
    "ply": ("fba.mesh._ply",),
    "vrml": ("fba.mesh._vrml",),
    "wfm": ("fba.mesh._wfm",),
    "points": ("fba.face.importers.points.points_file", "fba.face.importers.points.fdp"),
    "mapping": ("fba.capture.virtual_markers._mapping_files",),
    "import": ("fba.face.importers._mesh", "fba.face.importers._gltf", "fba.face.importers._mesh"),
    "cache": ("fba.cache",),
}  # fmt: skip
"""Modules that read what each target is fed with."""
LEAST_REACHED = 0.4
"""Share of the lines in functions of each: what writes is among them, and what refuses damage."""


@pytest.mark.parametrize("name", READING)
def test_files_of_the_corpus_reach_past_the_header(name: str) -> None:
    """They and 24 mutants run lines throughout what reads them."""
    coverage = pytest.importorskip("coverage")
    target = find_target(name)
    modules = [import_module(module) for module in READING[name]]
    paths = [str(module.__file__) for module in modules]
    watch = coverage.Coverage(data_file=None, include=paths, config_file=False)
    watch.start()
    try:
        engine.run(target, read_corpus(target), count=24, seed=SEED)
    finally:
        watch.stop()
    shares = {}
    for module, path in zip(READING[name], paths, strict=True):
        _, lines, _, missing, _ = watch.analysis2(path)
        inside = _lines_of_functions(Path(path)).intersection(lines)
        shares[module] = round(1 - len(inside.intersection(missing)) / len(inside), 2)
    assert {module: share for module, share in shares.items() if share < LEAST_REACHED} == {}


def _lines_of_functions(path: Path) -> set[int]:
    """Return the lines of a module that are in bodies of functions, which do not run on import."""
    functions = (node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.FunctionDef))
    return {line for one in functions for line in range(one.body[0].lineno, (one.end_lineno or 0) + 1)}


def test_mutations_are_made_from_their_numbers() -> None:
    streams = list(small_streams().values())
    one = [mutate(streams, Random(f"5 {number}"))[0] for number in range(200)]
    again = [mutate(streams, Random(f"5 {number}"))[0] for number in range(200)]
    assert one == again
    assert len(set(one)) > 150
    assert sum(stream in streams for stream in one) < 40


def test_a_defect_is_found_made_again_and_minimised(monkeypatch: pytest.MonkeyPatch) -> None:
    true_push = contract.Decoder.push_blocks

    def faulty(self: contract.Decoder, chunk: bytes) -> list[contract.Block]:
        if b"\x7f" in bytes(chunk):
            raise IndexError("a defect put in for this test")
        return true_push(self, chunk)

    monkeypatch.setattr(contract.Decoder, "push_blocks", faulty)
    streams = [small_streams()["talking"].replace(b"\x7f", b"\x70")]
    report = engine.run(find_target("stream"), streams, count=60, seed=1)
    (finding,) = report.findings
    assert "a defect put in for this test" in finding.reason
    assert finding.minimised == b"\x7f"
    assert engine.mutated(find_target("stream"), streams, 1, finding.number)[0] == finding.data
    assert engine.run_files(find_target("stream"), [finding.minimised]).findings[0].kind == finding.kind


def test_too_much_time_and_memory_are_findings(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    taken: list[object] = []

    def hungry(data: bytes, folder: Path) -> Outcome:
        # more than this process ever had: only then does its peak say what was taken
        more = engine._peak_memory() - engine._memory() + 300_000_000
        taken.append(np.ones(more, dtype=np.uint8))
        taken.clear()
        return Outcome(True)

    monkeypatch.setattr(Target, "load", lambda self: hungry)
    check = engine.Check(Target("own", "", ""), tmp_path)
    check.limit()
    with pytest.raises(ContractError, match=r"3 bytes took \d+ MB of memory"):
        check(b"abc")

    clock = iter(range(0, 1000, 7))
    monkeypatch.setattr(Target, "load", lambda self: lambda data, folder: Outcome(True))
    monkeypatch.setattr(engine.time, "process_time", lambda: float(next(clock)))
    with pytest.raises(ContractError, match=r"3 bytes took 7\.0 s of processor time"):
        engine.Check(Target("own", "", ""), tmp_path)(b"abc")


def test_minimising_keeps_what_fails() -> None:
    data = bytes(range(200)) * 3
    assert minimise(data, lambda one: one.count(b"\x07") >= 2, 10.0) == b"\x07\x07"


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a corpus, and functions to fuzz."""
    (tmp_path / f"{OWN}.py").write_text(FUNCTIONS)
    (tmp_path / "corpus").mkdir()
    (tmp_path / "corpus" / "one").write_bytes(
        b"one text with the letter e in it, for a test of the fuzzer!"[:-1]
    )
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_findings_are_saved_with_the_command_that_repeats_them(
    own: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["--target", f"{OWN}:raises", "--corpus", str(own / "corpus"), "--seed", "4"]
    assert program.main([*arguments, "--count", "200", "--jobs", "1"]) == 1
    output = capsys.readouterr().out
    assert "four times e" in output
    (saved,) = (path for path in (own / "fuzz-findings").iterdir() if path.suffix != ".txt")
    assert saved.read_bytes() == b"eeee"
    assert f"./dev fuzz --target {OWN}:raises fuzz-findings/{saved.name}" in output
    assert program.main(["--target", f"{OWN}:raises", str(saved)]) == 1
    assert "four times e" in capsys.readouterr().out


def test_a_crash_is_a_finding_and_the_run_goes_on(
    own: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(campaign, "MINIMISED_SECONDS", 0.0)
    arguments = ["--target", f"{OWN}:crashes", "--corpus", str(own / "corpus"), "--seed", "2"]
    assert program.main([*arguments, "--count", "60", "--jobs", "1"]) == 1
    output = capsys.readouterr().out
    assert "Abort" in output
    assert "61 inputs" in output
    (saved,) = (path for path in (own / "fuzz-findings").iterdir() if path.suffix != ".txt")
    assert b"{" in saved.read_bytes()


def test_unknown_targets_are_refused_with_a_list() -> None:
    with pytest.raises(OptionError, match=r"no target 'bhv' \(did you mean 'bvh'\?\).*stream-bounds"):
        find_target("bhv")
    with pytest.raises(SystemExit):
        program.main(["--target", "bhv"])


def test_guided_fuzzing_says_what_it_needs(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(guided, "find_spec", lambda name: None)
    with pytest.raises(SystemExit, match="2"):
        program.main(["--guided", "--target", "fap"])
    assert "--guided needs atheris" in capsys.readouterr().err


def test_guided_fuzzing_counts_its_inputs(
    own: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("atheris")
    monkeypatch.setattr(campaign, "MINIMISED_SECONDS", 0.0)
    arguments = ["--guided", "--target", f"{OWN}:raises", "--corpus", str(own / "corpus"), "--jobs", "1"]
    assert program.main([*arguments, "--minutes", "0.01"]) == 1
    assert "four times e" in capsys.readouterr().out


def test_a_corpus_without_files_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FbaError, match="no files to mutate here"):
        read_corpus(find_target("bvh"), tmp_path)


def alike(one: bytes, other: bytes) -> bool:
    """Whether two files are the same but for rounding, which depends on the processor's linear algebra.

    Texts, and glTF files: the JSON of those, and their arrays as float32. Of NumPy's files, the arrays: their
    headers are those of its version, and those of archives Python's.
    """
    if one == other:
        return True
    if one[:4] == other[:4] and one[:4] in (b"PK\3\4", b"\x93NUM"):
        return alike_arrays(read_arrays(one), read_arrays(other))
    if not one[:4] == other[:4] == b"glTF":
        return alike_texts(one, other)
    ends = [20 + int.from_bytes(file[12:16], "little") for file in (one, other)]
    if not alike_texts(one[20 : ends[0]].rstrip(), other[20 : ends[1]].rstrip()):
        return False
    files = zip((one, other), ends, strict=True)
    first, second = (np.frombuffer(file[end + 8 :], np.float32) for file, end in files)
    return first.shape == second.shape and np.allclose(first, second, rtol=1e-6, atol=1e-7)


def read_arrays(data: bytes) -> dict[str, np.ndarray]:
    found = np.load(io.BytesIO(data))
    if isinstance(found, np.ndarray):
        return {"": found}
    # What is no array in an archive is there as its bytes.
    return {
        name: np.frombuffer(part, np.uint8) if isinstance(part, bytes) else part
        for name, part in found.items()
    }


def alike_arrays(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> bool:
    return list(one) == list(other) and all(
        (first.dtype, first.shape) == (second.dtype, second.shape)
        and np.allclose(first, second, rtol=1e-6, atol=1e-7, equal_nan=True)
        for first, second in zip(one.values(), other.values(), strict=True)
    )


def alike_texts(one: bytes, other: bytes) -> bool:
    number = rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?"
    if re.sub(number, b"0", one) != re.sub(number, b"0", other):
        return False
    first, second = ([float(text) for text in re.findall(number, file)] for file in (one, other))
    return np.allclose(first, second, rtol=1e-9, atol=1e-12)


def archived(save: Callable[..., None], **arrays: np.ndarray) -> bytes:
    file = io.BytesIO()
    save(file, **arrays)
    return file.getvalue()


def test_files_that_only_round_differently_are_alike() -> None:
    assert alike(b"x 1.0000000001 -2e-17", b"x 1 0.0")
    assert not alike(b"x 1.001", b"x 1")
    assert not alike(b"x 1", b"y 1")
    assert not alike(b"x 1", b"x 1 1")
    places, times = np.arange(6.0).reshape(2, 3) / 7, np.arange(3)
    written = archived(np.savez_compressed, a=places, b=times)
    assert written != archived(np.savez, a=places, b=times)
    assert alike(written, archived(np.savez, a=places * (1 + 1e-9), b=times))
    for changed in ({"a": places + 0.001, "b": times}, {"a": places}, {"a": places, "c": times},
                    {"a": places[:1], "b": times}, {"a": places, "b": times.astype(float)}):  # fmt: skip
        assert not alike(written, archived(np.savez, **changed))
    kept = (CHECKOUT / "body" / "body.bin").read_bytes()
    values = np.frombuffer(kept[-16:], np.float32)
    assert alike(kept, kept[:-16] + (values * np.float32(1 + 2e-7)).tobytes())
    assert not alike(kept, kept[:-16] + (values + np.float32(0.001)).tobytes())


def test_the_corpus_is_what_its_script_makes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FBA_CACHE", str(tmp_path))  # the script sets it
    script = runpy.run_path(str(Path(__file__).parents[2] / "tools" / "make_fuzz_corpus.py"))
    made = {
        f"{target}/{name}.bin": data
        for target, files in script["corpus"](tmp_path).items()
        for name, data in files.items()
    }
    kept = {path.relative_to(CHECKOUT).as_posix(): path.read_bytes() for path in CHECKOUT.glob("*/*")}
    assert made.keys() == kept.keys()
    changed = {name for name, data in made.items() if not alike(kept[name], data)}
    assert {name for name in changed if not name.startswith("stream/")} == set()  # the encoder may improve
    assert sum(map(len, kept.values())) < 300_000


def test_a_report_is_plain_data() -> None:
    report = engine.Report("fap", count=3, findings=[engine.Finding("fap", 1, 2, "kind", "why", b"\0", b"")])
    content = json.loads(json.dumps(report.to_dict()))
    assert content["findings"] == [{"target": "fap", "seed": 1, "number": 2, "kind": "kind", "reason": "why"}]
