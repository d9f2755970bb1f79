"""Every block of code in the documentation runs as it stands, and every link leads somewhere.

Each page is followed as a reader would: from its first block to its last, in a fresh folder that holds
the sample files and nothing else. The language after the three backticks says what a block is:

    sh, python, js  runs; js where there is node.js
    console         needs a window, a network or the checkout: listed in `ILLUSTRATIONS` with the reason; the
                    `fba` commands in it must be ones that the command line accepts
    text            what the blocks before it print, line by line ("..." stands for lines left out)
    csv, json, tree data to read; html: a page to write

A block of no language, or indented instead of fenced, is an error: nothing is left out silently.

The pictures of the documentation: one command makes each of them, and each is shown somewhere.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlsplit

import click
import pytest

import graphics
from fba.cli.main import _COMMANDS, group
from ready_programs import BIN

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "SECURITY.md", *sorted(DOCS.glob("*.md"))]
SAMPLES = ROOT / "fba" / "samples"

RUN = {"sh", "python", "js"}
DATA = {"csv", "json", "tree", "html"}
COMMAND = re.compile(r"^\s*(\$ |fba |\./dev|python3? |pip |cd |import |from \w+ import )")

WINDOW = "opens a window, which stays until somebody closes it"
ARRIVING = "waits for a stream that arrives over a network"
SENT = "receives what a telephone sends"
VOICE = "needs a voice and a recogniser; tests/cli/speech runs the command where they are"
STORAGE = "needs a storage of S3's kind"
SYSTEM = "installs system packages"
CHECKOUT = "sets up or tests the checkout, which .ci/run does"
MISMATCH = "fba: walk.fba: BAP steps visage: the stream says so"
POOR = "fba: poor: walk.bvh: right hand faces 129 degrees off in frame 407; --report FILE.html shows it"
ILLUSTRATIONS = {
    ("README.md", "./dev demo --out demo"): CHECKOUT,
    ("README.md", ". .venv/bin/activate"): "chooses an environment",
    ("README.md", 'pip install ".[player]"'): "makes an environment, as .ci/run does",
    ("CONTRIBUTING.md", "./dev setup"): CHECKOUT,
    ("docs/bitrate.md", "./dev bitrate -o study"): "measures for a minute; tests/bitrate runs the command",
    ("docs/capture-live.md", "fba capture livelink --play -o face.fba"): WINDOW,
    ("docs/capture-live.md", "fba capture livelink -o face.fba"): SENT,
    ("docs/capture-live.md", "fba capture livelink -o face.fba --bitrate 3000 --buffer 1s"): SENT,
    ("docs/capture-live.md", "fba capture livelink -o - | fba play -"): WINDOW,
    ("docs/capture-live.md", "fba capture livelink --serve 8080 -o face.fba"): SENT,
    ("docs/capture-live.md", "fba serve hello.fba --loop"): "serves until somebody ends it",
    ("docs/live.md", "fba play rtp://0.0.0.0:5004"): WINDOW,
    (
        "docs/speak.md",
        "arecord -f S16_LE -r 16000 | fba speak --audio - -o - | fba play -",
    ): "needs a microphone",
    ("docs/live.md", "fba capture livelink -o - | fba send - --live rtp://192.168.0.20:5004"): SENT,
    ("docs/live.md", "fba capture rtp://0.0.0.0:5004 -o talk.fba"): ARRIVING,
    (
        "docs/live.md",
        "tshark -i lo -d udp.port==50205,rtp -d rtp.pt==96,mp4v-es -V",
    ): "watches a network; tests/carriage runs tshark",
    ("docs/capture-points.md", "python3 -m venv tracking"): "needs MediaPipe and its model",
    ("docs/carriage.md", "fba play hello.fba.mp4"): WINDOW,
    ("docs/speak.md", 'fba speak --text "Good morning. The blue boat moves away." -o morning.fba'): VOICE,
    ("docs/speak.md", "fba speak --audio talk.wav --text-file talk.txt -o talk.fba"): VOICE,
    ("docs/speak.md", 'pip install "mpeg4-fba[speech]"'): "makes an environment, as .ci/run does",
    ("docs/speak.md", 'fba speak --audio rede.wav --text "Guten Morgen" --language de-de -o rede.fba'): VOICE,
    (
        "docs/archives.md",
        "fba archive make streams/ --folders subject,emotion -o s3://training/faces",
    ): STORAGE,
    ("docs/cluster.md", "dask scheduler --host 10.0.0.1"): "needs several machines",
    ("docs/cluster.md", "fba archive make streams/ -o s3://training/faces"): STORAGE,
    (
        "docs/cluster.md",
        "fba convert --batch s3://captures/monday s3://streams/monday --to fba --scheduler tcp://10.0.0.1:8786",
    ): STORAGE,
    ("docs/develop.md", "./dev test"): CHECKOUT,
    ("docs/develop.md", "./dev bounds"): "takes hours; .ci/run runs a part, tests/fuzz the command",
    ("docs/develop.md", "./dev fuzz --minutes 30"): "takes minutes; tests/fuzz runs the command",
    ("docs/develop.md", "./dev fuzz --target bvh fuzz-findings/bvh-seed7-1234"): "a file found there",
    ("docs/develop.md", "python -m tools.figure.make_head"): "replaces the built-in head",
    (
        "docs/develop.md",
        "python -m tools.figure_checks",
    ): "takes minutes; test_closing.py runs two of its checks",
    (
        "docs/develop.md",
        "python -m tools.figure_sheets sheets",
    ): "needs the shared recordings, and takes minutes",
    (
        "docs/emotion.md",
        "fba emote hello.fap -o moods.mp4 --side-by-side --emotion neutral --emotion angry=90 "
        "--emotion surprised=80 --emotion sad=90 --emotion sleepy=90 --emotion happy=80",
    ): "draws for half a minute; tests/cli has pictures of the same",
    ("docs/face-models.md", "npm install gltf-validator"): "needs node.js and a network",
    ("docs/import-faces.md", "$ fba model points scan.obj -o scan.points.csv"): WINDOW,
    ("docs/measure.md", "./dev bench --summary > results.md"): "takes ten minutes",
    ("docs/motion-capture.md", POOR): "what is said of another file",
    ("docs/motion-capture.md", MISMATCH): "a warning, with figures of another file",
    (
        "docs/persona.md",
        "python -m tools.persona.evaluation",
    ): "takes minutes; tests/persona has fewer contents",
    ("docs/persona.md", "python -m tools.persona.blind_test"): "takes minutes; tests/persona has fewer takes",
    ("docs/persona.md", "python -m tools.persona.training -o default.recogniser"): "trains for a minute",
    ("docs/photos.md", "$ fba model photos front.jpg side.jpg -o me.glb --edit me.points.json"): WINDOW,
    ("docs/play.md", "fba play face.fba"): WINDOW,
    ("docs/play.md", "fba play"): WINDOW,
    ("docs/play.md", "fba play face.fba --audio voice.mp3 --audio-offset -0.04"): WINDOW,
    ("docs/play.md", "fba play hello.fap small.fba"): WINDOW,
    ("docs/play.md", "nc host 7000 | fba play -"): ARRIVING,
    ("docs/play.md", "apt-get install libegl1 libgl1"): SYSTEM,
    ("docs/virtual-markers.md", "$ fba markers talk.c3d head.obj --points head.points.csv"): WINDOW,
    (
        "docs/web.md",
        'fba conformance --decoder "node player/fba_player/web/conformance.mjs {in} {out} {bap_steps}"',
    ): "needs node.js and takes a minute; tests/player/web runs the program",
    ("docs/play.md", "import fba, pyrender"): "pyrender is not installed; tests/player has tests of it",
}
"""Blocks that do not run: page and first line, and why not."""


class Block(NamedTuple):
    page: str
    line: int
    language: str
    code: str

    @property
    def place(self) -> str:
        return f"{self.page}:{self.line}"

    @property
    def key(self) -> tuple[str, str]:
        return self.page, self.code.split("\n", 1)[0].split("  ")[0].strip()


def name_of(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


@cache
def lines_of(page: Path) -> list[str]:
    return page.read_text(encoding="utf-8").split("\n")


@cache
def blocks(page: Path) -> list[Block]:
    """All blocks of code of a page, in order; those that are indented instead of fenced have no language."""
    found: list[Block] = []
    fence: tuple[int, str, list[str]] | None = None
    blank = True
    for number, line in enumerate(lines_of(page), 1):
        if fence is not None:
            if line.strip() == "```":
                found.append(Block(name_of(page), fence[0], fence[1], "\n".join(fence[2]) + "\n"))
                fence = None
            else:
                fence[2].append(line)
            continue
        if line.startswith("```"):
            fence = (number, line[3:].strip(), [])
        elif line.startswith("    ") and blank:
            found.append(Block(name_of(page), number, "", line))
        blank = not line.strip()
    assert fence is None, f"{name_of(page)}:{fence[0]}: this block has no end"
    return found


def prose(page: Path) -> str:
    """A page without its blocks of code and without `code` in its lines."""
    kept: list[str] = []
    inside = False
    for line in lines_of(page):
        if line.startswith("```"):
            inside = not inside
        elif not inside:
            kept.append(line)
    return re.sub(r"`[^`\n]*`", "", "\n".join(kept))


def links(page: Path) -> list[str]:
    return re.findall(r"\]\(([^()\s]+)\)", prose(page))


def slug(heading: str) -> str:
    """The anchor that GitHub gives a heading."""
    text = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading.strip().strip("#").strip()).lower()
    return re.sub(r"[^\w\- ]", "", text.replace("`", "")).replace(" ", "-")


@cache
def anchors(page: Path) -> set[str]:
    found: set[str] = set()
    inside = False
    for line in lines_of(page):
        inside ^= line.startswith("```")
        if not inside and re.match(r"#{1,6} ", line):
            anchor, number = slug(line), 0
            while (anchor if not number else f"{anchor}-{number}") in found:
                number += 1
            found.add(anchor if not number else f"{anchor}-{number}")
    return found


def id_of(page: Path) -> str:
    return page.name


@pytest.mark.parametrize("page", PAGES, ids=id_of)
def test_every_block_says_what_it_is(page: Path) -> None:
    for block in blocks(page):
        assert block.language, f"{block.place}: a block of code needs a fence and a language"
        assert block.language in RUN | DATA | {"console", "text"}, f"{block.place}: {block.language}?"
        if block.language == "console":
            assert block.key in ILLUSTRATIONS, (
                f"{block.place}: let it run, or say in ILLUSTRATIONS why not: {block.key}"
            )
        elif block.language not in RUN | {"html"}:
            commands = [line for line in block.code.splitlines() if COMMAND.match(line)]
            assert not commands, f"{block.place}: looks like a command, and does not run: {commands}"


def test_every_reason_for_not_running_belongs_to_a_block() -> None:
    there = {block.key for page in PAGES for block in blocks(page) if block.language == "console"}
    assert not set(ILLUSTRATIONS) - there


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page)], ids=id_of)
def test_page_runs_from_its_first_block_to_its_last(page: Path, tmp_path: Path, programs: Path) -> None:
    folder, place = tmp_path / "reader", tmp_path / "place"
    folder.mkdir()
    for sample in SAMPLES.iterdir():
        shutil.copy(sample, folder)
    paths = [str(programs), str(BIN), os.environ["PATH"]]
    environment = {**os.environ, "PATH": os.pathsep.join(paths)}
    printed: set[str] = set()
    undrawn = False
    unrun = ""
    for block in blocks(page):
        if block.language == "text":
            shown = {line.strip() for line in block.code.splitlines()} - {"", "..."}
            assert undrawn or unrun or shown <= printed, (
                f"{block.place}: nothing before it prints {shown - printed}"
            )
        if block.language not in RUN:
            continue
        if block.language == "js" and shutil.which("node") is None:
            unrun = "no node here"
            continue
        if block.language == "python":
            command = [str(programs / "python"), "-c", block.code]
        elif block.language == "js":
            command = ["node", "--input-type=module", "-e", block.code]
        else:  # where it leads with `cd`, the next block begins
            command = ["sh", "-e", "-c", f"{block.code}\npwd >{shlex.quote(str(place))}"]
        run = subprocess.run(
            command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True,
            check=False,
        )  # fmt: skip
        if run.returncode and "OpenGL" in run.stderr and graphics.missing_opengl():
            undrawn = True
            continue
        assert not run.returncode, f"{block.place}:\n{block.code}\n{run.stdout[-2000:]}\n{run.stderr}"
        printed.update(line.strip() for line in run.stdout.splitlines())
        if block.language == "sh":
            folder = Path(place.read_text().strip())
    if undrawn:
        graphics.skip(graphics.missing_opengl())
    if unrun:
        pytest.skip(unrun)


def fba_commands(code: str) -> Iterator[list[str]]:
    """The arguments of every call of `fba` in a piece of shell code."""
    code = code.replace("\\\n", " ")
    for line in code.splitlines():
        words: list[str] = []
        for word in [*shlex.split(line, comments=True), ";"]:
            if word in {"|", ";", "&&", "&", ">", "<"} or word.endswith(";"):
                if word not in {";"}:
                    words.append(word.rstrip(";"))
                if words[:1] == ["fba"] or words[:2] == ["./dev", "fba"]:
                    arguments = words[words.index("fba") + 1 :]
                    yield [one for one in arguments if one not in {"|", "&&", "&", ">", "<", ""}]
                words = []
            else:
                words.append(word)


def accept(arguments: list[str]) -> None:
    """Let the command line take these arguments apart, without doing anything. Raises click's errors."""
    command: click.Command = group
    context = click.Context(group, info_name="fba")
    while isinstance(command, click.Group) and arguments and not arguments[0].startswith("-"):
        _, found, arguments = command.resolve_command(context, arguments)
        assert found is not None
        command = found
    arguments = [word.replace("*", "any") for word in arguments]
    for word in arguments:  # files and folders that only the reader has
        path = Path(word)
        if word.startswith("../") or word.endswith("/"):
            path.mkdir(exist_ok=True)
        elif re.fullmatch(r"[\w/.-]*\w\.[a-z]\w+", word):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()
    with command.make_context("fba", arguments, parent=context):
        pass


@pytest.mark.parametrize("page", PAGES, ids=id_of)
def test_commands_that_do_not_run_are_accepted(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for block in blocks(page):
        if block.language == "console":
            for arguments in fba_commands(block.code):
                try:
                    accept(arguments)
                except click.ClickException as error:
                    pytest.fail(f"{block.place}: fba {shlex.join(arguments)}: {error.format_message()}")


@pytest.mark.parametrize("page", PAGES, ids=id_of)
def test_options_in_the_text_exist(page: Path) -> None:
    """`fba render --fps` within a sentence: that command, with that option."""
    inside = False
    for number, line in enumerate(lines_of(page), 1):
        inside ^= line.startswith("```")
        for command in [] if inside else re.findall(r"`fba ([^`]+)`", line):
            words = command.split()
            context = click.Context(group, info_name="fba")
            found: click.Command | None = group
            while isinstance(found, click.Group) and words and re.fullmatch(r"[a-z]+", words[0]):
                found = found.get_command(context, words.pop(0))
            options = {"--help", "--version"}
            for parameter in found.params:
                options.update(parameter.opts, parameter.secondary_opts)
            unknown = {word.split("=")[0] for word in words if word.startswith("-") and word != "-"} - options
            assert not unknown, f"{name_of(page)}:{number}: fba {command}: no option {sorted(unknown)}"


@pytest.mark.parametrize("page", PAGES, ids=id_of)
def test_links_lead_somewhere(page: Path) -> None:
    for target in links(page):
        place = f"{name_of(page)} links to {target}"
        if re.match(r"[a-z][a-z0-9+.-]*:", target):
            parts = urlsplit(target)
            assert parts.scheme == "https", f"{place}: not https"
            assert "." in parts.netloc, f"{place}: no host"
            continue
        file, _, anchor = target.partition("#")
        there = (page.parent / file).resolve() if file else page
        assert there.exists(), f"{place}: no such file"
        if anchor:
            assert anchor in anchors(there), f"{place}: no such heading; there are {sorted(anchors(there))}"


def test_every_page_can_be_reached_from_the_readme() -> None:
    reached, waiting = set(), [ROOT / "README.md"]
    while waiting:
        page = waiting.pop()
        if page in reached or page.suffix != ".md" or not page.is_file():
            continue
        reached.add(page)
        waiting += [
            (page.parent / link.partition("#")[0]).resolve() for link in links(page) if ":" not in link
        ]
    assert not {name_of(page) for page in PAGES} - {name_of(page) for page in reached}


def test_every_picture_is_used() -> None:
    used = {(page.parent / link).resolve() for page in PAGES for link in links(page) if ":" not in link}
    assert not {path.name for path in (DOCS / "images").iterdir()} - {path.name for path in used}


@pytest.mark.parametrize("name", list(_COMMANDS))
def test_examples_under_help_are_accepted(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What `fba NAME --help` shows as examples is in the words that the command understands."""
    (tmp_path / "reader").mkdir()
    monkeypatch.chdir(tmp_path / "reader")
    command = group.get_command(click.Context(group), name)
    assert command is not None
    commands = [command]
    if isinstance(command, click.Group):
        commands += command.commands.values()
    for one in commands:
        assert one.epilog, f"{name} {one.name}: --help shows no example"
        examples = list(fba_commands(one.epilog))
        assert examples, f"{name} {one.name}: --help shows no example"
        for arguments in examples:
            assert arguments[0] == name
            try:
                accept(arguments)
            except click.ClickException as error:
                pytest.fail(f"fba {shlex.join(arguments)}: {error.format_message()}")


def test_the_page_of_public_names_is_what_its_script_makes() -> None:
    script = DOCS / "make_api_page.py"
    program = f"import runpy; print(runpy.run_path({str(script)!r})['make_page'](), end='')"
    made = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    assert made == (DOCS / "api.md").read_text(encoding="utf-8"), "run: python docs/make_api_page.py"


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """What `docs/make_pictures.py` makes: functions by the names of files."""
    monkeypatch.syspath_prepend(str(DOCS))
    pictures: dict[str, str] = import_module("make_pictures").PICTURES
    return pictures


def test_one_command_makes_every_picture_that_is_shown(made: dict[str, str]) -> None:
    shown = set()
    for page in (ROOT / "README.md", *DOCS.glob("*.md")):
        folder = "docs/images/" if page.name == "README.md" else "images/"
        shown |= set(re.findall(rf"\]\({folder}([^)]+)\)", page.read_text(encoding="utf-8")))
    assert shown == set(made)
    assert {path.name for path in (DOCS / "images").iterdir()} == set(made)


def test_every_picture_has_its_function(made: dict[str, str]) -> None:
    for name, function in made.items():
        module, _, what = function.rpartition(".")
        if module in ("pictures.loss_picture", "make_bitrate_page"):
            pytest.importorskip("matplotlib", reason="plots need matplotlib")
        assert callable(getattr(import_module(module), what)), name


def test_only_the_named_picture_is_made(
    made: dict[str, str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    script = import_module("make_pictures")
    monkeypatch.setattr(script, "IMAGES", tmp_path)
    written = []
    monkeypatch.setattr(script, "make", lambda function, names: written.append(names))
    monkeypatch.setattr(sys, "argv", ["make_pictures.py", "angry", "hello.png"])
    assert script.main() == 0
    assert written == [["angry.jpg"], ["hello.png"]]
    monkeypatch.setattr(sys, "argv", ["make_pictures.py", "angri"])
    with pytest.raises(SystemExit):
        script.main()
    assert "there is no picture 'angri' (did you mean 'angry'?)" in capsys.readouterr().err


def test_what_cannot_be_made_is_said(
    made: dict[str, str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    script = import_module("make_pictures")

    def fails(function: str, names: list[str]) -> None:
        raise FileNotFoundError("no recording")

    monkeypatch.setattr(script, "make", fails)
    monkeypatch.setattr(sys, "argv", ["make_pictures.py", "dance"])
    assert script.main() == 1
    assert "dance.jpg: not made: no recording" in capsys.readouterr().err
