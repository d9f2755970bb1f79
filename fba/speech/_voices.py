"""Voices of programs on the user's machine that speak a text: flite, and eSpeak NG."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path

from fba.errors import FormatError, OptionError, UnsupportedError
from fba.speech._text import ENGLISH

PROGRAMS = ("flite", "espeak-ng", "espeak")
"""Programs that speak, the first that is installed first; neither is needed, nor shipped."""
MOST_SECONDS = 600
"""After which a program is ended."""


def find_program(name: str | None = None) -> str:
    """Return the path of the program that speaks. name: one of `PROGRAMS`; None for any.

    Raises OptionError for another name, UnsupportedError where none is installed.
    """
    if name is not None and name not in PROGRAMS:
        raise OptionError(f"{name!r} is no program that speaks; they are {', '.join(PROGRAMS)}")
    for each in PROGRAMS if name is None else (name,):
        path = shutil.which(each)
        if path is not None:
            return path
    raise UnsupportedError(
        f"no program that speaks was found: install {name or 'flite or espeak-ng'} with the packages of your "
        "system, or give a recording"
    )


def speak_text(text: str, output: Path, *, program: str | None = None, language: str = ENGLISH) -> str:
    """Speak a text into a WAV file; return the name of the program. language: as of `split_text`.

    flite speaks English, eSpeak NG all others.

    Raises UnsupportedError where no program is installed, FormatError where it fails.
    """
    if program is None and not language.startswith("en"):
        program = "espeak-ng"
    path = find_program(program)
    name = Path(path).name.removesuffix(".exe")
    with tempfile.TemporaryDirectory(prefix="fba-") as folder:
        written = Path(folder) / "text.txt"
        written.write_text(text, encoding="utf-8")
        if name == "flite":
            words = [path, "-voice", "slt", "-f", str(written), "-o", str(output)]
        else:
            words = [path, "-v", language, "-f", str(written), "-w", str(output)]
        try:
            done = subprocess.run(words, capture_output=True, timeout=MOST_SECONDS, check=False)
        except subprocess.TimeoutExpired:
            raise FormatError(
                f"{name} did not finish the text in {MOST_SECONDS} s; give a shorter one"
            ) from None
    if done.returncode or not output.is_file() or not output.stat().st_size:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        raise FormatError(f"{name} could not speak the text: {said[-1] if said else 'it wrote no sound'}")
    return name
