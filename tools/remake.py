"""Make again the files that come with fba and depend on each other, in that order.

    python -m tools.remake                       # all of it, about a quarter of an hour
    python -m tools.remake head references       # the steps named

After a change of the figures, or of the definitions of visemes and expressions, what is made from them is
out of date, and tests fail. `git status` says what has changed; look at the references (out/sheet.png) and
the pictures.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
WEB = ROOT / "player" / "fba_player" / "web"
STEPS: dict[str, tuple[Path, list[str]]] = {
    "samples": (ROOT, [sys.executable, "tools/make_samples.py"]),
    "body": (ROOT, [sys.executable, "-m", "tools.figure.make_body"]),
    "head": (ROOT, [sys.executable, "-m", "tools.figure.make_head"]),
    "figures": (ROOT, [sys.executable, "-m", "tools.figure.make_figures"]),
    "capture": (ROOT, [sys.executable, "tools/make_face_capture.py"]),
    "web-figures": (ROOT, [sys.executable, "-m", "tools.web.make_figures"]),
    "web-tables": (ROOT, [sys.executable, "-m", "tools.web.make_page_tables"]),
    "web": (WEB, ["node", "build.mjs"]),
    "references": (ROOT, [sys.executable, "tests/helpers/make_references.py", "--sheet", "out/sheet.png"]),
    "corpus": (ROOT, [sys.executable, "tools/make_fuzz_corpus.py"]),
    "pictures": (ROOT, [sys.executable, "docs/make_pictures.py"]),
}
"""Folder and command of each step."""


def main() -> None:
    """Run the steps that the command line names, in the order of `STEPS`; stop at the first that fails."""
    parser = argparse.ArgumentParser(description="Make again the files that come with fba.")
    parser.add_argument("steps", nargs="*", metavar="STEP", help=f"one or more of: {', '.join(STEPS)}")
    wanted = parser.parse_args().steps or list(STEPS)
    if unknown := [step for step in wanted if step not in STEPS]:
        parser.error(f"there is no step {unknown[0]}, only: {', '.join(STEPS)}")
    for step, (folder, command) in STEPS.items():
        if step in wanted:
            print(f"== {step}", flush=True)
            if code := subprocess.run(command, cwd=folder, check=False).returncode:
                sys.exit(f"{step} failed with exit status {code}")


if __name__ == "__main__":
    main()
