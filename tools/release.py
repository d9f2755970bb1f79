"""Makes a release: checks version, changelog and checkout, runs all tests, builds both distributions, tags.

    python -m tools.release --check  # say what is missing
    python -m tools.release          # all steps; nothing leaves this machine

What it cannot do is publish: the last lines say how. CONTRIBUTING.md lists the steps before it.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = {"fba", "fba_player", "fba_conformance"}


def project_version(root: Path) -> str:
    """Return the version in pyproject.toml."""
    return str(tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"])


def faults_of_files(root: Path) -> list[str]:
    """Return what must change in the files before a release; empty if they are ready."""
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    version = str(project["version"])
    faults = []
    if not project.get("urls"):
        faults.append("pyproject.toml: [project.urls] is missing: give the address of the public repository")
    heading = re.search(r"^## (.+)$", (root / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    found = heading[1] if heading else "none"
    if not re.fullmatch(rf"{re.escape(version)} \(\d{{4}}-\d\d-\d\d\)", found):
        faults.append(f"CHANGELOG.md: the first heading must be '## {version} (YYYY-MM-DD)', found {found!r}")
    cited = re.search(r"^version: (\S+)$", (root / "CITATION.cff").read_text(encoding="utf-8"), re.MULTILINE)
    if cited is None or cited[1] != version:
        faults.append(f"CITATION.cff: the version must be {version}")
    return faults


def faults_of_checkout(root: Path) -> list[str]:
    """Return what must change in the checkout before a release; empty if it is ready."""
    faults = []
    if _git(root, "status", "--porcelain"):
        faults.append("the checkout has changes that are not committed")
    tag = f"v{project_version(root)}"
    if _git(root, "tag", "--list", tag):
        faults.append(f"the tag {tag} exists already: raise the version in pyproject.toml")
    return faults


def build(root: Path, folder: Path) -> list[Path]:
    """Build wheel and source distribution into an empty folder; return both files."""
    folder.mkdir(parents=True, exist_ok=True)
    if any(folder.iterdir()):
        raise SystemExit(f"{folder} is not empty: move the older distributions away")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-d", str(folder.resolve())], cwd=root, check=True
    )
    files = sorted(folder.iterdir())
    (wheel,) = (file for file in files if file.suffix == ".whl")
    with zipfile.ZipFile(wheel) as archive:
        missing = PACKAGES - {name.partition("/")[0] for name in archive.namelist()}
    if missing:
        raise SystemExit(f"{wheel.name} lacks {', '.join(sorted(missing))}")
    return files


def _git(root: Path, *words: str) -> str:
    return subprocess.run(
        ["git", *words], cwd=root, check=True, capture_output=True, text=True
    ).stdout.strip()


def main() -> None:
    """Run all steps, or only the checks."""
    parser = argparse.ArgumentParser(prog="python -m tools.release", description=__doc__.partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="only list what is missing")
    parser.add_argument("--skip-tests", action="store_true", help="do not run .ci/run, which takes an hour")
    parser.add_argument("--out", type=Path, default=ROOT / "dist", help="folder of the distributions")
    options = parser.parse_args()
    faults = faults_of_files(ROOT) + faults_of_checkout(ROOT)
    if faults:
        raise SystemExit("not ready for a release:\n" + "\n".join(f"- {fault}" for fault in faults))
    if options.check:
        print("ready for a release")
        return
    if not options.skip_tests:
        subprocess.run([ROOT / ".ci" / "run"], cwd=ROOT, check=True)
    files = build(ROOT, options.out)
    tag = f"v{project_version(ROOT)}"
    _git(ROOT, "tag", "--annotate", tag, "--message", f"fba {project_version(ROOT)}")
    print(f"built {', '.join(file.name for file in files)}; tagged {tag}. To publish:")
    print(f"  git push origin {tag}")
    print(f"  python -m twine upload {options.out}/*")


if __name__ == "__main__":
    main()
