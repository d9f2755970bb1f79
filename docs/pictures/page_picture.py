"""Make the picture of the page of `fba export`: `python docs/make_pictures.py page`; it takes Chromium."""

from __future__ import annotations

import io
import json
import shutil
import subprocess
import tempfile
from pathlib import Path

from PIL import Image

import fba
from fba_player.export.page import animation_page

ROOT = Path(__file__).parents[2]
WEB = ROOT / "player" / "fba_player" / "web"
PLAYER = "document.querySelector('fba-player')"
STEPS = [
    {"wait": f"{PLAYER}?.readyState === 4"},
    {"click": '[data-do="curves"]'},
    {"click": '[data-do="facts"]'},
    {"run": f"{PLAYER}.frame = 97, new Promise((done) => setTimeout(done, 1500))"},
]


def main() -> None:
    """Write docs/images/page.jpg."""
    with tempfile.TemporaryDirectory() as folder:
        page, shot = Path(folder) / "page.html", Path(folder) / "page.png"
        page.write_text(animation_page(fba.read(ROOT / "fba" / "samples" / "hello.fap")), encoding="utf-8")
        content = {
            "browser": "chromium",
            "path": shutil.which("chromium"),
            "page": str(page),
            "size": [1280, 800],
            "steps": [*STEPS, {"shot": str(shot)}],
        }
        runner = ROOT / "tests" / "player" / "web" / "browse.mjs"
        subprocess.run(
            ["node", runner, WEB / "node_modules"], input=json.dumps(content), text=True, check=True
        )
        picture = Image.open(io.BytesIO(shot.read_bytes())).convert("RGB")
    picture.save(ROOT / "docs" / "images" / "page.jpg", quality=88, optimize=True)
