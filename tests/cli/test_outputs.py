"""Where commands write: never onto what they read; "-" is standard output; pipes and devices stay."""

import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import click
import numpy as np
import pytest

import fba
from command_line import Run
from fba import Animation
from fba.cli import outputs
from fba.cli.main import _COMMANDS, group, main
from fba.cli.outputs import Output, Outputs, OutputType
from fba.codec import write_opening

FBA = [sys.executable, "-c", "from fba.cli.main import main; main()"]
POSIX = pytest.mark.skipif(os.name != "posix", reason="pipes and devices of Unix")


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, face: Animation, body: Animation) -> Path:
    """The current folder, with face.fap, body.bap, both.fba."""
    monkeypatch.chdir(tmp_path)
    fba.write(tmp_path / "face.fap", face)
    fba.write(tmp_path / "body.bap", body)
    fba.write(tmp_path / "both.fba", Animation(25, np.arange(50), face.face, body.body, "both"))
    return tmp_path


@pytest.fixture
def run_bytes(capsysbinary: pytest.CaptureFixture[bytes]) -> Callable[..., tuple[int, bytes, str]]:
    def call(*arguments: object) -> tuple[int, bytes, str]:
        capsysbinary.readouterr()
        with pytest.raises(SystemExit) as stop:
            main([str(one) for one in arguments])
        captured = capsysbinary.readouterr()
        return int(stop.value.code or 0), captured.out, captured.err.decode()

    return call


def commands() -> Iterator[tuple[str, click.Command]]:
    for name in _COMMANDS:
        command = group.get_command(None, name)  # type: ignore[arg-type]
        assert command is not None
        if isinstance(command, click.Group):
            yield from ((f"{name} {under}", each) for under, each in command.commands.items())
        else:
            yield name, command


def test_every_file_that_a_command_writes_is_an_output() -> None:
    """No option names a file that need not exist, but by OutputType; who has one has --no-clobber, too."""
    writing = set()
    for name, command in commands():
        options = {option for param in command.params for option in param.opts}
        for param in command.params:
            if isinstance(param.type, click.Path) and not param.type.exists:
                assert not param.type.file_okay, f"fba {name} {param.name}"  # a folder: fba demo --out
            if isinstance(param.type, OutputType) or param.name == "output":
                writing.add(name)
                assert "--no-clobber" in options, f"fba {name}"
    assert writing == {
        "encode", "decode", "convert", "render", "gait", "model import", "model fit", "model photos",
        "model points", "conformance", "capture", "markers", "express", "model learn-fit", "model simplify",
        "emote", "emotion", "persona learn", "persona play", "export", "send", "find", "speak",
    }  # fmt: skip


OVERWRITING = [
    "encode IN.fap -o OUT",
    "encode face.fap IN.bap -o OUT",
    "encode face.fap --epf IN.epf -o OUT",
    "encode face.fap --fit IN.glb -o OUT",
    "decode IN.fba --fap OUT",
    "decode IN.fba --bap OUT",
    "decode IN.fba --epf OUT",
    "decode IN.fba --fap new.fap -o OUT --to bvh",
    "decode both.fba -o OUT --model IN.glb",
    "decode both.fba -o OUT --body IN.glb",
    "convert IN.fap OUT",
    "convert IN.fba OUT --to fap",
    "convert both.fba OUT --model IN.glb",
    "render IN.png -o OUT",
    "render both.fba IN.png -o OUT",
    "render both.fba --audio IN.mp4 -o OUT",
    "render both.fba --model IN.png -o OUT",
    "render both.fba --body IN.png -o OUT",
    "render --contact-sheet faps --model IN.png -o OUT",
    "model import IN.glb -o OUT",
    "model import both.fba --points IN.json -o OUT",
    "model fit IN.csv -o OUT",
    "model points IN.csv -o OUT",
    "model fit both.fba --model IN.glb -o OUT",
    "model learn-fit IN.fap -o OUT",
    "model learn-fit both.fba --model IN.glb -o OUT",
    "model learn-fit IN.fap -o new.glb --fit OUT",
    "model simplify IN.glb -o OUT --faces 100",
    "emote IN.fap -o OUT --emotion angry",
    "emote face.fap -o OUT --keys IN.csv",
    "emote face.fap -o OUT --emotion angry --model IN.png",
    "markers IN.png -o OUT",
    "markers both.fba IN.glb -o OUT",
    "capture livelink --play --model IN.glb -o OUT",
    "find IN.png both.fba -o OUT",
    "find face.fap IN.png -o OUT",
    "find --build OUT IN.npz",
    "speak --audio IN.wav -o OUT",
    "speak --timings IN.json -o OUT",
    "speak --text-file IN.txt -o OUT",
    "send IN.fap rtp://127.0.0.1:50299 --sdp OUT",
]


@pytest.mark.parametrize("name", ["same", "path", "link", "hard"])
@pytest.mark.parametrize("line", OVERWRITING)
def test_an_input_is_never_overwritten(
    run: Run, here: Path, monkeypatch: pytest.MonkeyPatch, line: str, name: str
) -> None:
    monkeypatch.setattr("fba_player.sound.soundtrack.check_sound", lambda _: None)
    suffix = next(word for word in line.split() if word.startswith("IN")).removeprefix("IN")
    source, target = here / f"IN{suffix}", here / f"{name}{suffix}"
    source.write_bytes(b"precious")
    if name == "same":
        target = source
    elif name == "path":
        (here / "folder").mkdir()
        target = here / "folder" / ".." / source.name
    elif name == "link":
        target.symlink_to(source)
    else:
        os.link(source, target)
    _, out, err = run(*(str(target) if word == "OUT" else word for word in line.split()), code=2)
    assert out == ""
    assert "would overwrite the input" in " ".join(err.split())
    assert str(target) in err
    assert source.read_bytes() == b"precious"
    assert not (here / "new.fap").exists()


def test_a_file_that_an_input_names_is_not_overwritten(run: Run, here: Path) -> None:
    skin = here / "my skin.png"
    skin.write_bytes(b"precious")
    (here / "head.gltf").write_text(json.dumps({"images": [{"uri": "my%20skin.png"}]}))
    (here / "head.obj").write_text("mtllib head.mtl\n")
    (here / "head.mtl").write_text("map_Kd my skin.png\n")
    for model in ("head.gltf", "head.obj"):
        err = run("render", "both.fba", "--model", model, "-o", skin.name, code=2).err
        assert f"belongs to the input {model}" in " ".join(err.split())
    assert skin.read_bytes() == b"precious"
    (here / "heads").mkdir()
    (here / "heads" / "eye.png").write_bytes(b"precious")
    err = run("render", "both.fba", "--model", "heads", "-o", "heads/eye.png", code=2).err
    assert "a file of the folder heads" in " ".join(err.split())


def test_a_face_model_is_named_as_what_it_is(run: Run, here: Path) -> None:
    (here / "head.obj").write_bytes(b"x")
    err = run("model", "import", "head.obj", "-o", "head.mtl", code=2).err
    assert "name it head.glb" in " ".join(err.split())


def test_standard_input_is_an_input_as_well(here: Path, programs: Path) -> None:
    before = (here / "face.fap").read_bytes()
    with (here / "face.fap").open("rb") as source:
        done = subprocess.run(
            [programs / "fba", "convert", "-", "face.fap"],
            stdin=source,
            capture_output=True,
            text=True,
            check=False,
        )
    assert done.returncode == 2
    assert "would overwrite standard input" in " ".join(done.stderr.split())
    with (here / "face.fap").open("ab") as target:
        command = [programs / "fba", "convert", "face.fap", "-", "--to", "fap"]
        done = subprocess.run(command, stdout=target, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert "would overwrite the input face.fap" in " ".join(done.stderr.split())
    assert (here / "face.fap").read_bytes() == before


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("decode both.fba --fap x --bap x", "--fap x and --bap x are the same file"),
        ("decode both.fba --fap x --bap sub/../x", "are the same file"),
        ("decode both.fba --fap - --bap -", "--fap and --bap both go to standard output"),
        ("decode both.fba --fap /dev/stdout -o - --to bvh", "both go to standard output"),
        ("decode both.fba sub/both.fba --fap out", "both.fba and sub/both.fba would both become out"),
        ("decode both.fba both.fba --fap out", "both.fba is given twice"),
        ("decode both.fba sub/talk.fba --fap -", "need a folder for --fap, and - is not a folder"),
        ("decode sub/talk.fba sub/talk.fap --fap sub", "would overwrite the input sub/talk.fap"),
        ("encode - - -o x", "standard input (-) can be read only once"),
        ("decode both.fba -o -", "name the format for standard output with --to"),
        ("convert both.fba -", "name the format for standard output with --to"),
        ("gait -o -", "name the format for standard output with --to"),
        ("gait --list --to bap", "--to goes with -o"),
        ("render both.fba -o -", "name the format for standard output with --to: png, jpg, mp4, gif"),
        ("render both.fba -o x%05d.png --to png", "means numbered pictures"),
        ("render both.fba -o x%05d.png --replace --no-clobber", "contradict each other"),
        ("render --contact-sheet faps -o - --to mp4", "makes one picture, .png or .jpg"),
        ("encode face.fap -o nowhere/", "there is no folder nowhere/"),
        ("encode face.fap -o out", "out is a folder"),
        ("convert face.fap ''", "the name of a file is missing"),
    ],
)
def test_outputs_that_contradict(run: Run, here: Path, line: str, text: str) -> None:
    for name in ("sub/both.fba", "sub/talk.fba", "sub/talk.fap"):
        (here / name).parent.mkdir(exist_ok=True)
        (here / name).write_bytes(b"")
    (here / "out").mkdir()
    before = sorted(here.rglob("*"))
    _, out, err = run(*(word.strip("'") for word in line.split()), code=2)
    assert out == ""
    assert text in " ".join(err.split())
    assert sorted(here.rglob("*")) == before


def test_names_that_differ_in_case_may_be_one_file(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    new = [Output("--fap", here / "X.out"), Output("--bap", here / "x.out")]
    Outputs(new)
    monkeypatch.setattr(outputs, "_ignores_case", lambda _: True)
    with pytest.raises(click.UsageError, match="are the same file"):
        Outputs(new)


def test_whether_a_folder_ignores_case(tmp_path: Path) -> None:
    folder = tmp_path / "Folder" / "123"
    folder.mkdir(parents=True)
    assert outputs._ignores_case(str(folder)) == (tmp_path / "fOLDER").exists()
    if not (tmp_path / "fOLDER").exists():
        (tmp_path / "fOLDER").symlink_to(tmp_path / "Folder")  # what such a file system looks like
        assert outputs._ignores_case(str(folder))


STANDARD = [
    "encode face.fap -o {}",
    "encode face.fap body.bap -o {} --quant 4",
    "decode both.fba --fap {}",
    "decode both.fba --bap {}",
    "decode both.fba --epf {}",
    "decode both.fba -o {} --to fap",
    "convert body.bap {} --to bvh",
    "convert body.bap {} --to fba",
    "convert body.bap {} --to glb --no-mesh",
    "gait --cycles 1 -o {} --to bap",
    "express fear -o {} --to fap",
    "emote face.fap -o {} --to fap --emotion angry",
    "emotion face.fap -o {}",
]


@pytest.mark.parametrize("line", STANDARD)
def test_standard_output_holds_the_data_and_nothing_else(
    run_bytes: Callable[..., tuple[int, bytes, str]], here: Path, line: str
) -> None:
    before = sorted(here.iterdir())
    code, data, err = run_bytes(*line.format("-").split())
    assert code == 0
    assert "standard output" in err
    assert sorted(here.iterdir()) == before
    code, out, _ = run_bytes(*line.format("file").split())
    opening = write_opening("iso") if "body" in line and data.startswith(b"\0\0\1") else b""
    assert (code, data) == (0, opening + (here / "file").read_bytes())
    assert "file" in out.decode()


def test_reports_and_warnings_leave_standard_output_alone(
    run_bytes: Callable[..., tuple[int, bytes, str]], here: Path
) -> None:
    code, data, err = run_bytes("decode", "both.fba", "-o", "-", "--to", "bvh", "--json")
    assert code == 0
    assert data.startswith(b"HIERARCHY")
    assert "standard output: BVH holds no face" in err
    assert json.loads(err[err.index("{") :])["written"] == ["-"]
    code, data, err = run_bytes("encode", "face.fap", "-o", "-", "--json")
    assert fba.decode(data) == fba.read(here / "face.fap")
    assert json.loads(err)["frames"] == 50
    code, data, err = run_bytes("convert", "face.fap", "-", "--to", "bap")
    assert (code, data) == (1, b"")
    assert err.startswith("fba: error: standard output: a BAP file holds a body")


def test_binary_data_stays_off_a_terminal(run: Run, here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
    for line in ("encode face.fap -o -", "convert face.fap - --to fba", "render both.fba -o - --to png"):
        _, out, err = run(*line.split(), code=2)
        assert out == ""
        assert "a terminal cannot show this format; give" in " ".join(err.split())
    run("decode", "both.fba", "--fap", "-")
    assert sorted(path.name for path in here.iterdir()) == ["body.bap", "both.fba", "face.fap"]


@pytest.mark.usefixtures("here")
def test_a_file_whose_name_is_a_dash(run: Run) -> None:
    run("encode", "face.fap", "-o", "./-")
    run("decode", "./-", "--fap", "back.fap")
    assert fba.read("back.fap") == fba.read("face.fap")


def test_a_stream_on_standard_input_has_a_name_in_a_folder(here: Path, programs: Path) -> None:
    (here / "out").mkdir()
    with (here / "both.fba").open("rb") as source:
        subprocess.run([programs / "fba", "decode", "-", "--fap", "out"], stdin=source, check=True)
    assert os.listdir("out") == ["stdin.fap"]


@POSIX
@pytest.mark.parametrize(
    "line",
    [
        "--help",
        "encode --help",
        "info --trace both.fba",
        "info both.fba",
        "stats both.fba",
        "gait --list",
        "encode face.fap -o -",
        "decode both.fba --fap -",
        "convert face.fap - --to fba",
        "decode both.fba --fap /dev/stdout",
    ],
)
def test_a_closed_pipe_is_no_error(here: Path, line: str) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(
        [*FBA, *line.split()], cwd=here, stdout=writer, stderr=subprocess.PIPE, text=True, check=False
    )
    os.close(writer)
    assert (done.returncode, done.stderr) == (0, "")


@POSIX
def test_a_full_or_closed_standard_output(here: Path) -> None:
    if Path("/dev/full").exists():
        with open("/dev/full", "wb") as full:
            command = [*FBA, "decode", "both.fba", "--fap", "-"]
            done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
        assert (done.returncode, done.stderr) == (1, "fba: error: No space left on device\n")
    closed = ["sh", "-c", '"$@" >&-', "sh", *FBA, "decode", "both.fba", "--fap", "-"]
    done = subprocess.run(closed, cwd=here, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (
        1, "fba: error: standard output is closed; give the name of a file\n"
    )  # fmt: skip


@POSIX
def test_devices_and_open_files_are_written_to(run: Run, here: Path, programs: Path) -> None:
    for line in ("encode face.fap -o /dev/null", "decode both.fba --fap /dev/null --bap /dev/null"):
        run(*line.split())
    assert Path("/dev/null").is_char_device()
    kept = here / "kept"
    kept.write_bytes(b"before\n")
    for name in ("/dev/stdout", "/dev/fd/1", "-"):
        with kept.open("ab") as target:
            command = [programs / "fba", "decode", "both.fba", "--fap", name]
            subprocess.run(command, stdout=target, check=True)
    run("decode", "both.fba", "--fap", "alone")
    assert kept.read_bytes() == b"before\n" + 3 * (here / "alone").read_bytes()
    with kept.open("ab") as target:
        number = target.fileno()
        command = [*FBA, "decode", "both.fba", "--fap", f"/dev/fd/{number}"]
        subprocess.run(command, pass_fds=[number], check=True)
    assert kept.read_bytes() == b"before\n" + 4 * (here / "alone").read_bytes()


@POSIX
def test_a_named_pipe_waits_for_its_reader(run: Run, here: Path) -> None:
    pipe, received = here / "pipe", []
    os.mkfifo(pipe)
    thread = threading.Timer(0.5, lambda: received.append(pipe.read_bytes()))
    thread.start()
    err = run("decode", "both.fba", "--fap", pipe).err
    thread.join(30)
    assert "waiting for a reader" in err or received
    assert pipe.is_fifo()
    run("decode", "both.fba", "--fap", "alone")
    assert received == [(here / "alone").read_bytes()]
    assert "are the same file" in run("decode", "both.fba", "--fap", pipe, "--bap", pipe, code=2).err


CLOBBERING = [
    "encode face.fap -o there.fba",
    "decode both.fba --fap new.fap --bap there.fba",
    "decode both.fba --fap new.fap --epf there.fba",
    "decode both.fba --fap new.fap -o there.fba --to bvh",
    "decode there.fba both.fba --fap out",
    "convert face.fap there.fba",
    "gait -o there.fba",
    "express fear -o there.fba",
    "emote face.fap -o there.fba --emotion angry",
    "render both.fba -o there.fba --to png",
    "render --contact-sheet faps -o there.fba --to png",
    "model import face.fap -o there.glb",
    "model fit face.fap -o there.glb",
    "model points face.fap -o there.csv",
    "model learn-fit face.fap -o there.glb",
    "demo --out out",
]


@pytest.mark.parametrize("line", CLOBBERING)
def test_existing_files_stay_where_that_is_asked_for(run: Run, here: Path, line: str) -> None:
    (here / "out").mkdir()
    there = [here / name for name in ("there.fba", "there.glb", "there.csv", "out/both.fap", "out/hello.png")]
    for path in there:
        path.write_bytes(b"precious")
    _, out, err = run(*line.split(), "--no-clobber", code=1)
    assert out == ""
    assert "exists already; choose another name, or leave --no-clobber out" in err
    assert [path.read_bytes() for path in there] == [b"precious"] * 5
    assert not (here / "new.fap").exists()
    assert not (here / "out" / "there.fap").exists()


def test_existing_files_are_overwritten_else(run: Run, here: Path) -> None:
    (here / "there.fba").write_bytes(b"old")
    run("encode", "face.fap", "-o", "there.fba")
    assert fba.read("there.fba") == fba.read("face.fap")
    run("encode", "face.fap", "-o", "new.fba", "--no-clobber")
    assert (here / "new.fba").read_bytes() == (here / "there.fba").read_bytes()


@pytest.mark.parametrize("line", [line for line in CLOBBERING if "there." in line and "out" not in line])
def test_where_no_file_can_be_made_is_known_before_the_work(run: Run, here: Path, line: str) -> None:
    """The inputs are empty: reading them would be another error."""
    for name in ("face.fap", "both.fba"):
        (here / name).write_bytes(b"")
    before = sorted(here.iterdir())
    err = run(*line.replace("there.", "missing/there.").split(), code=1).err
    assert f"No such file or directory; make the folder {here / 'missing'} first" in err
    assert sorted(here.iterdir()) == before


@pytest.mark.usefixtures("opengl")
@pytest.mark.parametrize(("kind", "head"), [("png", b"\x89PNG"), ("jpg", b"\xff\xd8"), ("gif", b"GIF89a")])
def test_pictures_go_to_standard_output(
    run_bytes: Callable[..., tuple[int, bytes, str]], here: Path, kind: str, head: bytes
) -> None:
    end = ("--end", "0.1") if kind == "gif" else ()
    arguments = ("render", "face.fap", *end, "--size", "64x48", "--no-audio")
    code, data, err = run_bytes(*arguments, "-o", "-", "--to", kind)
    assert (code, err) == (0, "standard output: 64x48\n")
    assert data.startswith(head)
    assert run_bytes(*arguments, "-o", f"a.{kind}")[0] == 0
    assert data == (here / f"a.{kind}").read_bytes()
    assert run_bytes(*arguments, "-o", "bare", "--to", kind)[0] == 0
    assert data == (here / "bare").read_bytes()


@pytest.mark.usefixtures("opengl")
def test_a_film_goes_to_standard_output(run_bytes: Callable[..., tuple[int, bytes, str]], here: Path) -> None:
    av = pytest.importorskip("av")
    arguments = ("render", "face.fap", "--end", "0.1", "--size", "64x48", "-o", "-", "--to", "mp4")
    code, data, _ = run_bytes(*arguments)
    (here / "film").write_bytes(data)
    with av.open(str(here / "film")) as film:
        assert (code, film.streams.video[0].frames) == (0, 3)
    assert sorted(path.name for path in here.iterdir()) == ["body.bap", "both.fba", "face.fap", "film"]
