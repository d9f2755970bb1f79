"""Other decoders and encoders under test: right ones, and those that hang, crash or write nonsense."""

import os
import select
import sys
from fractions import Fraction
from pathlib import Path

import pytest

from fba import Decoder, FormatError
from fba_conformance._values import Listing, PlaneValues, block_values, read_values
from fba_conformance.suite import example_program, programs
from fba_conformance.suite.index import Vector, read_vectors
from fba_conformance.suite.programs import Program, check_decoder, check_encoder, parse_program, run_program
from fba_conformance.suite.runner import expected_listing
from tools.vectors import broken

VECTORS = {Path(one.name).stem: one for one in read_vectors()}
JAW, CUT = VECTORS["jaw"], VECTORS["two_damages"]
START = "import pathlib, sys, os, time; source, out = map(pathlib.Path, sys.argv[1:3]); "


def program(code: str, *, seconds: float = 120) -> Program:
    """A Python program, which has `source` and `out`; -S and -I because it needs nothing else."""
    return Program((sys.executable, "-I", "-S", "-c", START + code, "{in}", "{out}"), seconds)


def writing(text: str, *, exit_status: int = 0) -> Program:
    return program(f"out.write_text({text!r}); sys.exit({exit_status})")


RIGHT = expected_listing(JAW).text()


@pytest.mark.parametrize(
    ("tested", "message"),
    [
        (writing(RIGHT), ""),
        (writing("".join(line + "\r\n" for line in RIGHT.splitlines() if "time" not in line)), ""),
        (writing(RIGHT.replace("time 1/25", "time 0.0402")), ""),
        (writing(RIGHT.replace("time 1/25", "time 0.05")), "plane 1: its time is 0.05 s, expected 0.04 s"),
        (writing(RIGHT.replace("time 1/25\n", "")), "plane 1: it has no time, expected 0.04 s"),
        (writing(RIGHT.replace("fap 3 ", "fap 4 ", 1)), "plane 0: FAP 3 is not sent, expected 0"),
        (writing(RIGHT.rpartition("plane")[0] + "end\n"), "5 planes, expected 6"),
        (writing(RIGHT.removesuffix("end\n")), "the output breaks off behind 6 planes"),
        (writing(RIGHT.replace("end\n", "error\nend\n")), "reports damage in plane 6, which has none"),
        (writing(RIGHT, exit_status=3), "ended with exit status 3"),
        (writing(""), "plane"),
        (writing("Segmentation fault\n"), "line 1: expected the first line 'fba-values 1'"),
        (writing(RIGHT.replace("fap 3", "fap 3 x", 1)), "expected integers after `fap`"),
        (program("out.write_bytes(bytes(range(256)))"), "what it wrote is not text: byte 128 is 0x80"),
        (program("pass"), "wrote no file"),
        (program("out.mkdir()"), "wrote no file"),
        (program("sys.exit('no such codec')"), "ended with exit status 1: no such codec"),
        (program("time.sleep(60)", seconds=0.4), "took longer than 0.4 s and was stopped"),
        (Program(("/no/such/program", "{in}", "{out}")), "could not be started"),
    ],
)
def test_decoders_of_a_valid_stream(tested: Program, message: str) -> None:
    result = check_decoder(tested, JAW)
    assert result.decoded is not bool(message)
    assert message in result.message


BEFORE, WHOLE = expected_listing(CUT).text().split("error\n")
WRONG = "plane\nfap 3 1\nfap 4 1\nfap 48 1\n"


@pytest.mark.parametrize(
    ("tested", "message"),
    [
        (writing(f"{BEFORE}error some bits are wrong\n{WHOLE}"), ""),
        (writing(f"{BEFORE}error\nend\n"), ""),
        (writing(f"{BEFORE}error\n"), ""),
        (writing(f"{BEFORE}end\n", exit_status=1), ""),
        (writing(f"{BEFORE}plane\nfap 3", exit_status=1), "expected `fap`"),
        (writing(f"{BEFORE}plane\nfap 3 4\n", exit_status=1), ""),
        (writing("fba-values 1\nerror\nend\n"), ""),
        (writing("", exit_status=1), ""),
        (program("sys.exit(1)"), ""),
        (program("pass"), "wrote no file"),
        (writing(f"{BEFORE}end\n"), "reports no error; the stream is damaged in plane 2"),
        (writing(f"{BEFORE}{WHOLE}"), "reports no error"),
        (writing(f"{BEFORE}{WRONG}error\nend\n"), "3 planes, expected 2"),
        (writing(f"{BEFORE}error\n{WRONG}end\n"), "3 planes, expected 2"),
        (program("time.sleep(60)", seconds=0.4), "took longer"),
    ],
)
def test_decoders_of_a_damaged_stream(tested: Program, message: str) -> None:
    result = check_decoder(tested, CUT)
    assert result.decoded is not bool(message)
    assert message in result.message


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_a_crash_is_named_and_children_are_stopped(tmp_path: Path) -> None:
    result = check_decoder(program("sys.stderr.write('bad\\n'); sys.stderr.flush(); os.abort()"), CUT)
    assert (result.decoded, result.message) == (False, "crashed (signal SIGABRT): bad")
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    child = f"import subprocess; subprocess.run(['sh', '-c', 'exec >{pipe}; echo begun; sleep 600']); "
    assert "took longer" in check_decoder(program(child, seconds=1.5), JAW).message
    said = b""
    with open(reader, "rb", buffering=0) as alive:  # ends when no child has it open any more
        while (part := alive.read(100)) != b"":
            assert part or select.select([alive], [], [], 60)[0], "a child goes on"
            said += part or b""
    assert said in (b"begun\n", b"")


def test_endless_output_is_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fba_conformance.suite.programs.OUTPUT_LIMIT", 1 << 20)
    endless = "f = out.open('wb')\nwhile True: f.write(bytes(4096)); sys.stderr.write('x' * 999)"
    words = [sys.executable, "-I", "-S", "-c", START.replace("; ", "\n") + endless, "in"]
    found = run_program([*words, str(tmp_path / "out")], tmp_path / "out", 60)
    assert found.stopped == "wrote more than 1 MB and was stopped"


def test_other_steps_need_a_place_in_the_command() -> None:
    result = check_decoder(writing(RIGHT), VECTORS["body_visage"])
    assert (result.decoded, result.passed) == (None, True)
    assert "the command has no {bap_steps}" in result.skipped


def test_optional_vectors_may_fail() -> None:
    result = check_decoder(writing(RIGHT), VECTORS["old_codes"])
    assert (result.decoded, result.exact, result.passed) == (False, False, True)


def in_process(monkeypatch: pytest.MonkeyPatch, *, decoder: str) -> None:
    """Programs run here instead: what `example_program` does, without starting Python for each vector."""

    def run(self: Program, values: dict[str, str], output: Path) -> programs.Run:
        decode = getattr(example_program, decoder)
        lines = decode(Path(values["in"]).read_bytes(), values["bap_steps"])
        output.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
        return programs.Run(0)

    monkeypatch.setattr(Program, "run", run)


@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
@pytest.mark.parametrize("decoder", ["decode_textbook", "decode_codec"])
def test_the_independent_decoder_and_ours_pass_as_programs(
    monkeypatch: pytest.MonkeyPatch, decoder: str
) -> None:
    in_process(monkeypatch, decoder=decoder)
    tested = parse_program("decode {in} {out} {bap_steps}")
    chosen = [one for one in VECTORS.values() if one.group in {"first steps", "start codes", "damage"}]
    results = [check_decoder(tested, vector) for vector in chosen]
    assert [result.line() for result in results if not result.exact] == []


@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
@pytest.mark.parametrize(
    ("mistake", "found", "passed"),
    [
        ("steps-always-iso", "body_visage", "body"),
        ("closing-bits-unchecked", "closing_bits_body", "dct_body"),
    ],
)
def test_a_decoder_with_a_mistake_fails_as_a_program(
    monkeypatch: pytest.MonkeyPatch, mistake: str, found: str, passed: str
) -> None:
    def run(self: Program, values: dict[str, str], output: Path) -> programs.Run:
        monkeypatch.setattr(
            sys, "argv", ["broken", mistake, values["in"], values["out"], values["bap_steps"]]
        )
        broken.main()
        return programs.Run(0)

    monkeypatch.setattr(Program, "run", run)
    tested = parse_program("decode {in} {out} {bap_steps}")
    assert [check_decoder(tested, VECTORS[name]).decoded for name in (found, passed)] == [False, True]


def encoded_by_us(monkeypatch: pytest.MonkeyPatch, vector: Vector) -> programs.Result:
    def run(self: Program, values: dict[str, str], output: Path) -> programs.Run:
        arguments = ["encode", values["in"], values["out"], "--rate", values["rate"]]
        for name in ("bap_steps", "fap_quant", "bap_quant"):
            arguments += [f"--{name.replace('_', '-')}", values[name]]
        monkeypatch.setattr(sys, "argv", ["program", *arguments])
        example_program.main()
        return programs.Run(0)

    monkeypatch.setattr(Program, "run", run)
    return check_encoder(parse_program("e {in} {out} {bap_steps} {rate} {fap_quant} {bap_quant}"), vector)


@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
@pytest.mark.parametrize("name", ["jaw", "body_visage", "face_and_body", "skips", "time_code", "rate_ntsc"])
def test_our_encoder_passes_as_a_program(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    assert encoded_by_us(monkeypatch, VECTORS[name]).line().endswith("encoded exact")


@pytest.mark.parametrize("name", ["two_damages", "old_codes", "rate_changes", "fap_quant_00_07"])
def test_what_is_not_for_encoders_is_skipped(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    result = encoded_by_us(monkeypatch, VECTORS[name])
    assert (result.encoded, result.skipped.partition(":")[0]) == (None, "not for encoders")


def test_encoders_that_are_wrong() -> None:
    stream = JAW.data()
    copied = program(f"out.write_bytes({stream!r})")
    assert check_encoder(copied, JAW).encoded is True
    assert "plane 0: FAP 4 is not sent" in check_encoder(copied, VECTORS["rate_30_5"]).message
    assert "damaged" in check_encoder(program(f"out.write_bytes({stream[:20]!r})"), JAW).message
    assert check_encoder(program("pass"), JAW).message == "wrote no file"
    assert "has no {fap_quant}" in check_encoder(copied, VECTORS["alphabets_after_division"]).skipped


# --- the text of values ---------------------------------------------------------------------------------


def test_text_of_values_and_back() -> None:
    planes = [
        PlaneValues(Fraction(13, 25), (1, 0, 63, 0), (3, 40, 0, 0, 0, 1), {3: 120, 68: -5}, {296: 2**31 - 1}),
        PlaneValues(None, None, None, {}, {}),
    ]
    listing = Listing(planes, 1)
    text = listing.text()
    assert text == (
        "fba-values 1\nplane\ntime 13/25\nviseme 1 0 63 0\nexpression 3 40 0 0 0 1\nfap 3 120\nfap 68 -5\n"
        "bap 296 2147483647\nerror\nplane\nend\n"
    )
    assert read_values(text) == listing
    messy = "# mine\n\n fba-values  1\r\nplane # 0\n\tviseme 1 0 +63 0\n\ntime 0.50\nend"
    assert read_values(messy) == Listing([PlaneValues(Fraction(1, 2), (1, 0, 63, 0))])


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("fap 3 1", "values before the first line `plane`"),
        ("plane\nfap 3", "expected `fap`, a number in 1..68"),
        ("plane\nfap 3 1\nfap 3 1", "that the plane has not yet"),
        ("plane\nfap 69 1", "a number in 1..68"),
        ("plane\nbap 0 1", "a number in 1..296"),
        ("plane\nbap 1 1e3", "expected integers after `bap`"),
        ("plane\nbap 1 ٣", "expected integers"),
        ("plane\nviseme 1 2 3", "expected one `viseme` in a plane, with 4 numbers"),
        ("plane\nexpression 1 2 3 4 5 6\nexpression 1 2 3 4 5 6", "expected one `expression`"),
        ("plane\ntime -1", "expected one `time`"),
        ("plane\ntime nan", "expected one `time`"),
        ("plane\ntime 1/0", "a time divided by 0"),
        ("plane\nplane 1", "expected plane, time, viseme"),
        ("end\nplane", "a line after `end`"),
        ("plane\nfap 3 " + "9" * 5000, "expected integers"),
    ],
)
def test_wrong_lines_are_named(lines: str, message: str) -> None:
    text = f"fba-values 1\n{lines}\n"
    with pytest.raises(FormatError, match="line") as caught:
        read_values(text)
    assert message in str(caught.value)
    assert caught.value.line == len(text.splitlines())
    assert len(str(caught.value)) < 250


def test_values_of_blocks_and_of_the_trace_are_the_same() -> None:
    """As the runner compares them: our decoder in pieces against the committed digest."""
    vector = VECTORS["body_joins"]
    decoder = Decoder()
    blocks = [block for byte in vector.data() for block in decoder.push_blocks(bytes([byte]))]
    blocks += decoder.finish_blocks()
    assert Listing(block_values(blocks)).digest() == vector.entry["values"]
