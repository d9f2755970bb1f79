"""The page of `fba export` in real browsers: pictures as on the desktop, controls, hostile input."""

import json
import os
import re
import shutil
import subprocess
import wave
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

import fba
from fba.animation import Animation, FaceTrack
from fba.cli.main import group
from fba.serving import Server, show_file, split_stream
from fba_player import web
from fba_player.export.page import PageStream, make_page
from gltf_edits import edit
from zoo_heads import MAKERS, original
from zoo_heads import write as write_head

SAMPLES = Path(__file__).parents[3] / "fba" / "samples"
MODULES = Path(__file__).parents[3] / "player" / "fba_player" / "web" / "node_modules"
RUNNER = Path(__file__).with_name("browse.mjs")
BROWSERS = {
    "chromium": ("chromium", "chromium-browser", "google-chrome"),
    "firefox": ("firefox-esr", "firefox"),
}
SIZE = (640, 480)
PLAYER = "document.querySelector('fba-player')"
READY = f"Boolean({PLAYER}?.readyState === 4 || {PLAYER}?.error)"
MOST_OTHER_PIXELS = {"talk": 0.0001, "poses": 0.0001, "body": 0.001}
MOST_MEAN_DIFFERENCE = 1.0
"""Of 255, over the picture: how far the page may be from the desktop player."""
POSES: list[dict[int, int]] = [
    {49: 60000}, {48: -40000, 49: 30000}, {3: 600, 49: -70000},
    {31: 500, 32: 500, 33: 500, 34: 500, 35: 500, 36: 500}, {37: 130, 38: 130, 31: -300, 32: -300},
    {12: 400, 13: 400, 59: 600, 60: 600, 6: 500, 7: 500, 41: 600, 42: 600},
]  # fmt: skip
"""FAPs of heads that turn, and that wrinkle forehead, brow and cheeks."""

Browse = Callable[..., dict[str, Any]]
Step = dict[str, Any]


def _missing(browser: str) -> str:
    """Return what a test in a browser lacks here, or ""."""
    if shutil.which("node") is None:
        return "node"
    if not (MODULES / "playwright-core").is_dir() or not (MODULES / "puppeteer-core").is_dir():
        return "playwright-core and puppeteer-core (npm ci in player/fba_player/web)"
    if browser == "firefox" and shutil.which("xvfb-run") is None:
        return "xvfb-run"
    return "" if _program(browser) else browser


def _program(browser: str) -> str | None:
    return next(filter(None, map(shutil.which, BROWSERS[browser])), None)


@pytest.fixture(params=BROWSERS)
def browse(request: pytest.FixtureRequest, tmp_path: Path) -> Browse:
    """Take steps on a page in a browser; the results, and the errors that the page reported."""
    browser = request.param
    if missing := _missing(browser):
        if os.environ.get("FBA_REQUIRE_BROWSERS"):
            pytest.fail(f"no {missing} here")
        pytest.skip(f"no {missing} here")

    def take(page: str, steps: list[Step], size: tuple[int, int] = SIZE) -> dict[str, Any]:
        file = tmp_path / "page.html"
        file.write_text(page, encoding="utf-8")
        content = {
            "browser": browser,
            "path": _program(browser),
            "page": page if page.startswith("http:") else str(file),
            "size": size,
            "steps": steps,
        }
        command = ["node", str(RUNNER), str(MODULES)]
        if browser == "firefox":
            command = ["xvfb-run", "-a", "-s", "-screen 0 1600x1200x24", *command]
        done = subprocess.run(
            command, input=json.dumps(content), capture_output=True, text=True, check=False, cwd=tmp_path
        )
        assert done.returncode == 0, done.stderr
        result: dict[str, Any] = json.loads(done.stdout)
        return result

    return take


@pytest.fixture(scope="module")
def head_page(tmp_path_factory: pytest.TempPathFactory) -> str:
    return _exported(tmp_path_factory.mktemp("head"), [SAMPLES / "hello.fap"])


@pytest.fixture(scope="module")
def hello() -> Animation:
    return fba.read(SAMPLES / "hello.fap")


def _exported(folder: Path, files: list[Path], *options: str) -> str:
    out = folder / "page.html"
    done = CliRunner().invoke(
        group, ["export", *map(str, files), "-o", str(out), *options], catch_exceptions=False
    )
    assert done.exit_code == 0, done.output
    return out.read_text(encoding="utf-8")


@pytest.mark.parametrize("what", ["talk", "poses", "body"])
def test_pictures_are_those_of_the_desktop_player(browse: Browse, what: str, tmp_path: Path) -> None:
    """Outlines off by two pixels would be 2,000 of 307,200. Below the knees the desktop draws a shadow."""
    animation, frames, view, rows = {
        "talk": (fba.read(SAMPLES / "hello.fap"), [0, 18, 40, 66, 97, 120, 151, 190], "front", SIZE[1]),
        "poses": (_posed(POSES), [*range(len(POSES))], "front", SIZE[1]),
        "body": (fba.read(SAMPLES / "hello.bvh"), [0, 80], "body", SIZE[1] * 6 // 10),
    }[what]
    file = tmp_path / "stream.fba"
    file.write_bytes(fba.encode(animation))
    steps: list[Step] = [{"wait": READY}, {"key": "h"}]
    for frame in frames:
        drawn = "(turn) => new Promise((done) => requestAnimationFrame(() => done(turn && next(turn - 1))))"
        moved = f"{PLAYER}.frame = {frame}, (window.next = {drawn})(5)"
        steps += [{"run": moved}, {"shot": str(tmp_path / f"page{frame}.png")}]
    assert browse(_exported(tmp_path, [file], "--view", view), steps)["errors"] == []
    for frame in frames:
        theirs = tmp_path / f"desktop{frame}.png"
        arguments = ["render", str(file), "-o", str(theirs), "--frame", str(frame)]
        done = CliRunner().invoke(group, [*arguments, "--camera", view, "--size", "640x480", "--lod", "full"])
        assert done.exit_code == 0, done.output
        shown, wanted = (
            np.asarray(Image.open(path).convert("RGB")).astype(np.int16)[:rows]
            for path in (tmp_path / f"page{frame}.png", theirs)
        )
        apart = np.abs(shown - wanted).max(axis=2)
        assert (apart > 50).mean() < MOST_OTHER_PIXELS[what], frame
        assert apart.mean() < MOST_MEAN_DIFFERENCE, frame


def _posed(poses: list[dict[int, int]]) -> Animation:
    values = np.zeros((len(poses), 68), dtype=np.int32)
    for row, pose in zip(values, poses, strict=True):
        row[[fap - 1 for fap in pose]] = [*pose.values()]
    mask = np.ones(values.shape, dtype=bool)
    mask[:, :2] = False
    return Animation(rate=Fraction(25), index=np.arange(len(poses)), face=FaceTrack(values, mask))


def test_controls_by_mouse_and_keys(browse: Browse, head_page: str) -> None:
    time, paused = f"{PLAYER}.currentTime", f"{PLAYER}.paused"
    played = browse(
        head_page,
        [
            {"wait": READY},
            {"click": '[data-do="play"]'},
            {"wait": f"{time} > 0.3"},
            {"key": " "},
            {"run": paused},  # 4
            {"key": "Home"},
            {"run": f"{PLAYER}.frame"},  # 6
            {"key": "ArrowRight"},
            {"key": "Shift+ArrowRight"},
            {"run": f"{PLAYER}.frame"},  # 9
            {"click": '[data-do="back"]'},
            {"run": f"{PLAYER}.frame"},  # 11
            {"click": ".track input", "at": 0.5},
            {"run": f"{time} / {PLAYER}.duration"},  # 13
            {"key": "["},
            {"key": "End"},
            {"run": f"{PLAYER}.frame === {PLAYER}.frames - 1"},  # 16
            {"run": f"{PLAYER}.range.map((at) => at / {PLAYER}.duration)"},  # 17
            {"click": '[data-do="loop"]'},
            {"run": f"{PLAYER}.loop"},  # 19
            {"key": "+"},
            {"run": f"{PLAYER}.playbackRate"},  # 21
            {"click": '[data-do="curves"]'},
            {"run": f"{PLAYER}.shadowRoot.querySelector('.lanes').hidden"},  # 23
            {"click": '[data-do="facts"]'},
            {"run": f"{PLAYER}.shadowRoot.querySelector('.facts').textContent"},  # 25
            {"run": f"{PLAYER}.view"},  # 26
            {"key": "3"},
            {"run": f"{PLAYER}.view"},  # 28
            {"drag": [[0.5, 0.5], [0.6, 0.5]]},
            {"run": f"{PLAYER}.view"},  # 30
            {"key": "h"},
            {"run": f"{PLAYER}.hasAttribute('controls')"},  # 32
        ],
    )
    results = played["results"]
    assert played["errors"] == []
    assert results[4] is True
    assert results[6] == 0
    assert results[9] == 11
    assert results[11] == 10
    assert results[13] == pytest.approx(0.5, abs=0.03)
    assert results[16] is True
    assert results[17] == pytest.approx([results[13], 1], abs=1e-6)
    assert results[19] is False, "marks of a loop switch it on, the button off"
    assert results[21] == 1.25
    assert results[23] is False
    assert "241" in results[25] or "frames" in results[25]
    assert (results[26], results[28], results[30]) == ("", "profile", "moved")
    assert results[32] is False


LANES = """
import { expressionsOf, visemesOf } from "./lanes.js";
const rows = JSON.parse(process.argv.at(-1));
const face = ([viseme, expression]) => ({ mask: [viseme !== null, expression !== null], viseme, expression });
const frame = (at) => ({ face: face(rows[at]) });
const frames = { length: rows.length, framesPerSecond: 10, indexOf: (at) => at, frame };
console.log(JSON.stringify([visemesOf(frames), expressionsOf(frames)]));
"""


@pytest.mark.skipif(shutil.which("node") is None, reason="no node here")
def test_what_was_sent_stays_in_force_in_the_lanes() -> None:
    rows = [
        ([10, 0, 63], [1, 63, 0, 0]), (None, None), ([1, 2, 10], [1, 0, 0, 0]), (None, None),
        ([0, 0, 63], None),
    ]  # fmt: skip
    folder = Path(web.__file__).parent / "page"
    command = ["node", "--input-type=module", "-e", LANES, json.dumps(rows)]
    done = subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True)
    visemes, expressions = (
        [(row["name"], row["from"], row["to"], row["share"]) for row in lane]
        for lane in json.loads(done.stdout)
    )
    assert visemes == [("A:", 0, 0.2, 1), ("f v", 0.2, 0.4, 1)]
    assert expressions == [("joy", 0, 0.2, 1)]


def test_a_damaged_stream_says_so_and_shows_what_is_right(browse: Browse, hello: Animation) -> None:
    data = bytearray(fba.encode(hello, fba.EncoderOptions(intra_period=25)))
    data[len(data) // 2] ^= 0x55
    results = browse(
        make_page([PageStream("damaged.fba", bytes(data))]),
        [{"wait": READY}, {"run": f"{PLAYER}.shadowRoot.querySelector('.message').textContent"}],
    )["results"]
    assert "damaged" in results[1]


@pytest.mark.parametrize("data", [b"", b"\0\0\1\xba", b"<script>alert(1)</script>" * 9])
def test_what_is_no_stream_is_an_error_on_the_page(browse: Browse, data: bytes) -> None:
    name = "</script><script>window.hacked = 1</script><img src=x onerror='window.hacked = 1'>.fba"
    results = browse(
        make_page([PageStream(name, data)], title=name),
        [
            {"wait": READY},
            {"run": f"{PLAYER}.error.message"},
            {"run": "window.hacked === undefined"},
            {"run": f"{PLAYER}.shadowRoot.querySelector('.message img, .message script') === null"},
            {"run": "document.title"},
        ],
    )["results"]
    assert results[1].startswith(name)
    assert results[2:] == [True, True, name]


def test_pages_hold_no_network_addresses(head_page: str) -> None:
    assert not re.findall(r"(?:src|href)\s*=\s*[\"']?(?:https?:)?//", head_page)
    assert "default-src 'none'" in head_page
    assert len(head_page) < 1_200_000


def test_ten_minutes(browse: Browse, hello: Animation) -> None:
    assert hello.face is not None
    count = 15_000
    rows = np.arange(count) % len(hello)
    track = FaceTrack(hello.face.values[rows], hello.face.mask[rows])
    longer = replace(hello, index=np.arange(count), face=track)
    data = fba.encode(longer, fba.EncoderOptions(intra_period=250))
    results = browse(
        make_page([PageStream("long.fba", data)]),
        [
            {"wait": READY},
            {"run": f"{PLAYER}.frames"},
            {"key": "End"},
            {"run": f"{PLAYER}.frame"},
            {"run": f"{PLAYER}.currentTime = 300, {PLAYER}.play(), 1"},
            {"wait": f"{PLAYER}.currentTime > 300.5"},
        ],
    )["results"]
    assert results[1] == count
    assert results[3] == count - 1


def test_the_sound_is_the_clock(browse: Browse, hello: Animation, tmp_path: Path) -> None:
    with wave.open(str(tmp_path / "tone.wav"), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(8000)
        file.writeframes(bytes(2 * 8000 * 12))
    page = make_page([PageStream("talk.fba", fba.encode(hello))], audio=tmp_path / "tone.wav", loop=True)
    audio = f"{PLAYER}.playback.audio"
    apart = f"Math.abs({audio}.currentTime - {PLAYER}.currentTime)"  # right after a picture, however slow
    results = browse(
        page,
        [
            {"wait": READY},
            {"wait": f"{audio}.readyState >= 2"},
            {"click": '[data-do="play"]'},
            {"wait": f"{audio}.currentTime > 0.3"},
            {"run": f"new Promise((done) => requestAnimationFrame(() => done({apart} < 0.15)))"},
            {"click": '[data-do="sound"]'},
            {"run": f"{audio}.muted"},
        ],
    )["results"]
    assert results[4] is True
    assert results[6] is True


def test_live(browse: Browse, hello: Animation) -> None:
    stream = split_stream(fba.encode(hello, fba.EncoderOptions(intra_period=25, start_codes=True)))
    page = make_page([], with_body=True, live=True).encode()
    with Server(page, ["hello", "<b>other"], port=0) as server:
        server.start(0, lambda stage: show_file(stage, stream, loop=True))
        count = f"{PLAYER}.addEventListener('frames', ({{detail}}) => window.count += detail)"
        heard = f"(window.count ??= ({count}, 1))"
        results = browse(
            server.url,
            [
                {"wait": f"{PLAYER}?.readyState === 4"},
                {"wait": f"{heard} > 20"},
                {"run": f"{PLAYER}.paused"},
                {"run": f"{PLAYER}.duration === Infinity"},
                {"run": "document.title"},
                {"run": f"{PLAYER}.shadowRoot.querySelector('.streams').textContent"},
            ],
        )
    assert results["errors"] == []
    assert results["results"][2:] == [False, True, "hello", "hello<b>other"]


def test_glb_heads_in_the_element(browse: Browse, hello: Animation, tmp_path: Path) -> None:
    """A head with FBA_face, one with ARKit's shapes, and one that needs what is not read."""
    site = tmp_path / "site"
    site.mkdir()
    original("grid").save(site / "described.glb")
    write_head(MAKERS[0], "grid", site / "shaped.glb")
    shutil.copy(site / "shaped.glb", site / "packed.glb")
    needs = {"extensionsRequired": ["KHR_draco_mesh_compression"]}
    edit(site / "packed.glb", lambda document: document.update(needs))
    shutil.copy(MODULES.parent / "dist" / "fba-player.min.js", site)
    (site / "hello.fba").write_bytes(fba.encode(hello))
    (site / "index.html").write_text(
        '<!doctype html><link rel="icon" href="data:,">'
        '<script type="module" src="fba-player.min.js"></script>'
        '<fba-player src="hello.fba" model="described.glb" controls></fba-player>'
    )

    def show(model: str) -> str:
        steps = (
            "const ready = new Promise((done) => (p.onready = done))",
            "for (const name of ['loadeddata', 'error']) p.addEventListener(name, p.onready, { once: true })",
            f"p.setAttribute('model', '{model}')",
            "p.setAttribute('src', 'hello.fba')",
            "await ready",
            "return p.error?.message ?? ''",
        )
        return f"(async (p) => {{ {'; '.join(steps)} }})({PLAYER})"

    handler = partial(_Quiet, directory=str(site))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = Thread(target=server.serve_forever)
        thread.start()
        try:
            results = browse(
                f"http://127.0.0.1:{server.server_port}/index.html",
                [
                    {"wait": f"{PLAYER}?.readyState === 4 || {PLAYER}?.error"},
                    {"run": f"{PLAYER}.error?.message ?? ''"},
                    {"run": show("shaped.glb")},
                    {"run": show("packed.glb")},
                    {"run": f"{PLAYER}.shadowRoot.querySelector('.message').textContent"},
                ],
            )
        finally:
            server.shutdown()
            thread.join()
    assert results["errors"] == []
    assert results["results"][1:3] == ["", ""]
    assert "KHR_draco_mesh_compression" in results["results"][3]
    assert "fba export --model head.glb -o head.fbam" in results["results"][4]


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *_: object) -> None:
        pass
