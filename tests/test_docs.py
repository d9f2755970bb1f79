"""Every command and every piece of code in the documentation runs."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import graphics
import numpy as np
import pytest

import fba
from fba import Animation, FaceTrack
from fba.formats import merge

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
SAMPLES = ROOT / "fba" / "samples"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The files that the pages speak of."""
    talk = fba.read(SAMPLES / "hello.fap")[:60]
    body = fba.read(SAMPLES / "hello.bvh")
    gesture = body.resample(25)[:60]
    fba.write(tmp_path / "talk.fap", talk)
    fba.write(tmp_path / "old.fap", talk)
    fba.write(tmp_path / "gesture.bap", gesture)
    shutil.copy(SAMPLES / "hello.bvh", tmp_path / "walk.bvh")
    lines = (tmp_path / "talk.fap").read_text().splitlines()
    first_frame = next(i for i, line in enumerate(lines) if line.startswith(("0 ", "1 ")) and len(line) > 130)
    (tmp_path / "headless.fap").write_text("\n".join(lines[first_frame:]) + "\n")
    values = np.zeros((5, 68), dtype=np.int32)
    values[:, 13] = [0, 900, 1800, 2700, 900]  # FAP 14 has a step of 1: 1860 is the end of its ranges
    mask = np.zeros((5, 68), dtype=bool)
    mask[:, 13] = True
    fba.write(tmp_path / "wild.fap", Animation(25, np.arange(5), FaceTrack(values, mask)))
    fba.write(tmp_path / "talk.fba", talk)
    fba.write(tmp_path / "small.fba", talk, fap_quant=8)
    fba.write(tmp_path / "both.fba", merge(talk, gesture), bap_steps="visage", clamp=True)
    damaged = bytearray(fba.encode(talk, fba.EncoderOptions(intra_period=1, start_codes=True)))
    damaged[len(damaged) // 2] ^= 0x5A
    (tmp_path / "damaged.fba").write_bytes(damaged)
    planes = fba.Decoder().push((tmp_path / "talk.fba").read_bytes())
    from fba.formats.epf import write_epf

    write_epf(tmp_path / "talk.epf", [frame.plane.settings for frame in planes])
    return tmp_path


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(
        rf"^```{language}\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
    )


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_page(page: Path, folder: Path) -> None:
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    programs = [(["sh", "-e", "-c", code], code) for code in blocks(page, "sh")]
    programs += [([sys.executable, "-c", code], code) for code in blocks(page, "python")]
    undrawn = False
    for command, code in programs:
        run = subprocess.run(
            command, cwd=folder, env=environment, capture_output=True, text=True, check=False
        )
        if run.returncode and "OpenGL" in run.stderr and graphics.missing_opengl():
            undrawn = True
            continue
        assert run.returncode == 0, f"{page.name}:\n{code}\n{run.stdout[-2000:]}\n{run.stderr}"
    if undrawn:
        graphics.skip(graphics.missing_opengl())


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), f"{page.name} links to {target}"


def test_every_subcommand_has_examples_that_run(folder: Path) -> None:
    """The commands under --help use names that the pages use as well."""
    from fba.cli.main import _COMMANDS, group

    for name in _COMMANDS:
        command = group.get_command(None, name)  # type: ignore[arg-type]
        assert command is not None
        assert command.epilog, f"fba {name} --help shows no example"
        assert f"fba {name}" in command.epilog
