"""What a stranger trips over before the first frame is coded: the scripts, the packaging, the imports."""

import itertools
import os
import re
import shutil
import subprocess
import sys
import tomllib
import venv
import zipfile
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import InvalidRequirement, Requirement
from packaging.utils import canonicalize_name

import fba
from tools import release

ROOT = Path(__file__).parents[1]
PACKAGES = {"fba": "fba", "fba_player": "player/fba_player", "fba_conformance": "conformance/fba_conformance"}
"""Package as it is installed -> its folder in the repository."""
LARGEST_FILE = 5_000_000
HEAVY = {"numpy", "numba", "scipy", "moderngl", "glfw", "PIL", "av", "click"}
TOOLS = ("cat", "cksum", "cut", "dirname", "grep", "ls", "mkdir", "mv", "readlink", "rm", "sed", "tail", "tr")


def pyproject() -> dict[str, Any]:
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def tracked() -> list[str]:
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("not a git checkout")
    listing = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=False)
    if listing.returncode:
        pytest.skip(f"git does not list the checkout: {listing.stderr.decode().strip()}")
    return [name for name in listing.stdout.decode().split("\0") if name]


# --- the repository -----------------------------------------------------------------------------------


def test_no_large_file_is_tracked() -> None:
    sizes = {name: (ROOT / name).stat().st_size for name in tracked() if (ROOT / name).is_file()}
    assert "pyproject.toml" in sizes
    assert {name: size for name, size in sizes.items() if size > LARGEST_FILE} == {}


def test_no_two_test_files_have_the_same_name() -> None:
    """As tests/ is no package, pytest refuses the second of two files with one name."""
    names = [Path(name).name for name in tracked() if name.startswith("tests/")]
    names = [name for name in names if name.startswith("test_") and name.endswith(".py")]
    assert len(names) > 100
    assert sorted(name for name in set(names) if names.count(name) > 1) == []


STAGES = [
    f".ci/stages/{path.name}"
    for path in sorted((ROOT / ".ci" / "stages").iterdir())
    if not path.suffix and path.name != "common"
]


@pytest.mark.parametrize(
    ("script", "shell"), [("dev", "sh"), (".ci/run", "bash"), *((name, "bash") for name in STAGES)]
)
def test_script_runs_as_it_is(script: str, shell: str) -> None:
    path = ROOT / script
    assert os.access(path, os.X_OK)
    assert path.read_text(encoding="utf-8").splitlines()[0].endswith(shell)
    if shutil.which(shell) is None:
        pytest.skip(f"no {shell} here")
    assert subprocess.run([shell, "-n", path], capture_output=True, text=True, check=False).stderr == ""


@pytest.mark.parametrize("name", STAGES)
def test_stages_name_tests_that_exist(name: str) -> None:
    """Else pytest runs none of the others."""
    patterns = re.findall(r"\btests/[^\s\\]+", (ROOT / name).read_text(encoding="utf-8"))
    words = subprocess.check_output(["bash", "-c", f"echo {' '.join(patterns)}"], cwd=ROOT, text=True).split()
    assert [word for word in words if not (ROOT / word).exists()] == []


def test_ci_leaves_to_the_coverage_what_that_runs() -> None:
    """On the oldest Python, each test runs in one stage, but for long ones and those of the documentation."""
    rooms = re.search(r"rooms='([^']*)'", (ROOT / "dev").read_text(encoding="utf-8"))
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    left_out = re.findall(r"--ignore=tests/([^\s)]+)", script)
    assert left_out == [*rooms[1].split(), "player/web"]  # ./dev web runs the last
    assert all((ROOT / "tests" / room).is_dir() for room in left_out)
    deselected = re.findall(r"\[ \$last = 0 \] \|\| elsewhere\+=\(--deselect=(\S+) -m \"not slow\"\)", script)
    assert deselected == ["tests/test_docs.py"]  # the newest Python runs it, and those that take long


@pytest.mark.parametrize("script", ["dev", ".ci/run", *STAGES])
def test_shellcheck_is_content(script: str) -> None:
    if shutil.which("shellcheck") is None:
        pytest.skip("no shellcheck here")
    done = subprocess.run(
        ["shellcheck", "-x", "-P", ROOT, ROOT / script], capture_output=True, text=True, check=False
    )
    assert done.stdout == ""


@pytest.mark.skipif(sys.platform == "win32", reason="a shell script")
def test_pythons_are_found_once_each_and_shims_do_not_count(tmp_path: Path) -> None:
    shims, version = tmp_path / "shims", tmp_path / "pyenv" / "versions" / "3.x" / "bin"
    shims.mkdir()
    version.mkdir(parents=True)
    for minor in range(11, 16):  # as pyenv has them where the version is not chosen
        shim = shims / f"python3.{minor}"
        shim.write_text("#!/bin/sh\nexit 127\n")
        shim.chmod(0o755)
    (version / "python3").symlink_to(sys.executable)
    environment = {
        **{name: value for name, value in os.environ.items() if name not in {"PYTHON", "FBA_VENV"}},
        "PATH": f"{shims}{os.pathsep}{os.environ['PATH']}",
        "PYENV_ROOT": str(tmp_path / "pyenv"),
    }
    done = subprocess.run(
        [ROOT / "dev", "pythons"], env=environment, capture_output=True, text=True, check=True
    )
    found = [line.split(" ", 1) for line in done.stdout.splitlines()]
    minors = [int(minor) for minor, _ in found]
    assert minors == sorted(set(minors))
    assert sys.version_info.minor in minors
    for minor, path in found:
        assert shims not in Path(path).parents
        ask = [path, "-c", "import sys; print(sys.version_info.minor)"]
        assert subprocess.run(ask, capture_output=True, text=True, check=True).stdout == f"{minor}\n"


# --- the package --------------------------------------------------------------------------------------


def test_version_is_the_same_everywhere() -> None:
    assert pyproject()["project"]["version"] == fba.__version__
    assert f"\nversion: {fba.__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_a_release_needs_a_date_an_address_and_one_version(tmp_path: Path) -> None:
    def write(urls: str, heading: str, cited: str) -> list[str]:
        (tmp_path / "pyproject.toml").write_text(f'[project]\nversion = "1.2"\n{urls}')
        (tmp_path / "CHANGELOG.md").write_text(f"# Changelog\n\n## {heading}\n")
        (tmp_path / "CITATION.cff").write_text(f"title: x\nversion: {cited}\n")
        return [fault.partition(":")[0] for fault in release.faults_of_files(tmp_path)]

    urls = '[project.urls]\nSource = "https://example.org/fba"\n'
    assert write(urls, "1.2 (2026-12-01)", "1.2") == []
    assert write("", "1.2 (unreleased)", "1.1") == ["pyproject.toml", "CHANGELOG.md", "CITATION.cff"]
    assert write(urls, "1.1 (2026-12-01)", "1.2") == ["CHANGELOG.md"]


@pytest.mark.parametrize("name", sorted(fba.__all__))
def test_public_name_can_be_imported(name: str) -> None:
    assert getattr(fba, name).__name__.rpartition(".")[2] == name


def test_rooms_are_imported_where_they_are_first_used() -> None:
    """As docstrings have it: `import fba`, and then `fba.persona.learn`, each in a process of its own."""
    code = "import fba; print(*(fba.__getattr__(name).__name__ for name in fba._MODULES))"
    for use in ("persona.learn", "planning.encode_planned", "live.Capture", "body.BodyModel"):
        subprocess.run([sys.executable, "-c", f"import fba; fba.{use}"], cwd=ROOT, check=True)
    listed = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    rooms = {path.parent.name for path in (ROOT / "fba").glob("*/__init__.py")}
    assert rooms - {name.removeprefix("fba.") for name in listed.stdout.split()} == {"cli", "gltf", "mesh"}


def test_all_packages_say_that_they_are_typed() -> None:
    """So that a user's type checker reads their hints."""
    assert {name for name, folder in PACKAGES.items() if not (ROOT / folder / "py.typed").is_file()} == set()


def test_importing_the_package_loads_nothing_heavy() -> None:
    code = "import fba, sys; print(*{name.partition('.')[0] for name in sys.modules})"
    command = [sys.executable, "-c", code]
    loaded = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    names = set(loaded.stdout.split())
    assert "fba" in names
    assert names & HEAVY == set()


def test_compiled_code_runs_where_no_folder_can_be_written() -> None:
    pytest.importorskip("numba")
    code = """
from numba.core import caching
caching.FunctionCache._impl_class._locator_classes = []  # as for a user without a home
from fba.compiled import compiled, inlined
@inlined
def double(x):
    return 2 * x
@compiled
def quadruple(x):
    return double(double(x))
print(quadruple(21))
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("84\n", "")


@pytest.mark.parametrize(
    ("name", "rows"), [("fap.csv", 68), ("bap.csv", 296), ("feature_points.csv", 84), ("joints.csv", 87)]
)
def test_tables_come_with_the_package(name: str, rows: int) -> None:
    text = (files("fba.parameters") / name).read_text(encoding="utf-8")
    assert len(text.strip().splitlines()) == 1 + rows


@pytest.fixture(scope="session")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built from this checkout."""
    pytest.importorskip("hatchling", reason="hatchling comes with the extra `dev`")
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    done = subprocess.run(build, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (path,) = folder.glob("*.whl")
    return path


def test_wheel_holds_every_file_of_the_packages_and_no_other(wheel: Path) -> None:
    expected = {
        f"{package}/{name.removeprefix(f'{folder}/')}"
        for name in tracked()
        for package, folder in PACKAGES.items()
        if name.startswith(f"{folder}/") and (ROOT / name).exists()
    }
    assert wheel.name.startswith("mpeg4_fba-")  # `fba` is someone else's on the index
    with zipfile.ZipFile(wheel) as archive:
        held = {name for name in archive.namelist() if ".dist-info/" not in name}
    assert len(expected) > 300
    assert {f"{package}/py.typed" for package in PACKAGES} <= held
    assert expected - held == set()
    assert {name for name in held if not name.startswith(tuple(f"{p}/" for p in PACKAGES))} == set()
    assert "fba_player/web/dist/fba.min.js" in held
    assert {name for name in held if {"__pycache__", "node_modules"} & set(name.split("/"))} == set()


INSTALLED = """
import sys
checkout, site, mine = sys.argv[1:]
sys.path[:] = [site, *(path for path in sys.path if not path.startswith(checkout) or ".venv" in path), mine]
import conformance, fba, player
from fba.player import Scene
import fba_conformance.suite.runner
print(player.WHOSE, conformance.WHOSE)
for module in (fba, sys.modules[Scene.__module__], fba_conformance.suite.runner):
    print(module.__file__.startswith(site))
"""


def test_installed_beside_a_users_own_modules_each_finds_its_own(wheel: Path, tmp_path: Path) -> None:
    """A user's `player.py` and `conformance.py` lie last on the path, where any module of ours would win."""
    site, mine = tmp_path / "site", tmp_path / "mine"
    mine.mkdir()
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    for name in ("player", "conformance"):
        (mine / f"{name}.py").write_text("WHOSE = 'mine'\n", encoding="utf-8")
    command = [sys.executable, "-c", INSTALLED, str(ROOT), str(site), str(mine)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.stdout.split(), done.stderr) == (["mine", "mine", "True", "True", "True"], "")


@pytest.mark.parametrize(
    ("old", "new"), [("player", "from fba.player import"), ("conformance", "from fba_conformance import")]
)
def test_old_names_of_packages_fail_with_the_new_ones(old: str, new: str) -> None:
    command = [sys.executable, "-c", f"import {old}"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith(f"ImportError: the package '{old}' is now called 'fba")
    assert new in done.stderr


PC = {"sys_platform": "linux", "platform_machine": "x86_64", "platform_python_implementation": "CPython"}
MAC = PC | {"sys_platform": "darwin", "platform_machine": "arm64"}


@pytest.mark.parametrize(
    ("platform", "python", "missing"),
    [
        (PC, "3.11", set()),
        (PC, "3.14", set()),
        (MAC, "3.13", set()),
        (MAC | {"platform_machine": "x86_64"}, "3.13", {"imgui-bundle", "miniaudio"}),
        (MAC | {"platform_machine": "x86_64"}, "3.14", {"numba", "moderngl", "imgui-bundle", "miniaudio"}),
        (PC | {"platform_machine": "aarch64"}, "3.11", {"moderngl", "imgui-bundle", "miniaudio"}),
        (PC | {"platform_machine": "riscv64"}, "3.13", {"numba", "moderngl", "imgui-bundle", "miniaudio"}),
        (PC | {"platform_python_implementation": "PyPy"}, "3.11", {"numba", "imgui-bundle", "miniaudio"}),
    ],
    ids=lambda value: value if isinstance(value, str) else None,
)
def test_only_what_has_wheels_is_required(platform: dict[str, str], python: str, missing: set[str]) -> None:
    project = pyproject()["project"]
    listed = [*project["dependencies"], *project["optional-dependencies"]["player"]]
    requirements = [Requirement(text) for text in listed]
    environment = platform | {"python_version": python, "python_full_version": f"{python}.0"}
    left_out = {r.name for r in requirements if r.marker and not r.marker.evaluate(environment)}
    assert left_out == missing


def test_the_plain_package_needs_only_what_encodes_converts_and_draws_a_picture() -> None:
    """Films, sound and windows are extras; all of them come with `player`, and with the checkout's `dev`."""
    project = pyproject()["project"]
    extras = project["optional-dependencies"]
    names = {extra: {Requirement(text).name for text in listed} for extra, listed in extras.items()}
    plain = {Requirement(text).name for text in project["dependencies"]}
    assert plain == {"numpy", "numba", "scipy", "bitstring", "click", "moderngl", "pillow"}
    assert names["films"] == {"av"}
    assert names["player"] == {project["name"], "glfw", "imgui-bundle", "miniaudio"}
    assert f"{project['name']}[films]" in extras["player"]
    assert f"{project['name']}[player]" in extras["dev"]


INSTALLS = re.compile(r"\bpip3?(?: --python \S+)? install((?:[ \t]+[^\s`|&;)]+)+)")
FOREIGN = {"docs/capture-points.md: mediapipe", "examples/track_a_film/track_a_film.py: mediapipe"}
"""Programs of others that a page tells to install, in an environment of their own."""
CURES = re.compile(r"\bcure\(\w+, [\"']([^\"']+)[\"']\)")


def dependencies() -> set[str]:
    """The names of all packages that pyproject.toml lists, and pip itself."""
    project = pyproject()["project"]
    listed = [*project["dependencies"], *itertools.chain(*project["optional-dependencies"].values())]
    names = {canonicalize_name(Requirement(text).name) for text in listed}
    return names - {project["name"]} | {"pip"}  # extras name the distribution itself


def installed(command: str) -> Iterator[str]:
    """What a `pip install` installs, without options; the text may go on as a sentence behind it."""
    for word in command.split():
        bare = word.strip("\"'")
        if bare.startswith(">"):  # output goes to a file
            return
        if bare.startswith(("-", "$@", "{")):
            continue
        yield bare if bare == "." else bare.rstrip(".,:\"'")
        ends_string = word.endswith(("'", '"')) and not word.startswith(("'", '"'))
        if ends_string or (bare != "." and bare.endswith((".", ",", ":"))):
            return


def is_ours(target: str) -> bool:
    """Whether that is this checkout, with extras that exist, or a file."""
    if target.endswith(".whl"):
        return "/" in target or target.startswith(canonicalize_name(pyproject()["project"]["name"]))
    found = re.fullmatch(r"(?:\.|mpeg4-fba(?=\[))(?:\[([\w,$]+)\])?", target)
    extras = pyproject()["project"]["optional-dependencies"]
    return bool(found) and all(
        extra in extras for extra in (found[1] or "").split(",") if extra and not extra.startswith("$")
    )


@pytest.mark.parametrize(
    ("text", "targets", "good"),
    [
        ("pip install .", ["."], True),
        ('pip install ".[pyrender]"', [".[pyrender]"], True),
        ('pip install ".[pyrnder]"', [".[pyrnder]"], False),
        ('pip install "fba[pyrender]"', ["fba[pyrender]"], False),
        ("Install it with: pip install fba. Or not", ["fba"], False),
        ("pip install mpeg4-fba", ["mpeg4-fba"], False),  # until it is published
        # Where it is installed, pip takes the extras of what is there.
        ('pip install "mpeg4-fba[films]"', ["mpeg4-fba[films]"], True),
        ('pip install "mpeg4-fba[flims]"', ["mpeg4-fba[flims]"], False),
        ("pip install imgui_bundle, or else", ["imgui_bundle"], True),
        ("pip install -q --only-binary=:all: av glfw", ["av", "glfw"], True),
        ("pip install pyav", ["pyav"], False),
        ('pip --python "$p" install --quiet "$work"/dist/*.whl ||', ['$work"/dist/*.whl'], True),
    ],
)
def test_what_counts_as_an_installation(text: str, targets: list[str], good: bool) -> None:
    (command,) = INSTALLS.findall(text)
    assert list(installed(command)) == targets
    assert all(is_ours(target) or is_listed(target) for target in targets) == good


def is_listed(target: str) -> bool:
    """Whether that is one of our dependencies by its own name."""
    try:
        return canonicalize_name(Requirement(target).name) in dependencies()
    except InvalidRequirement:
        return False


def test_nobody_is_told_to_install_a_package_of_a_stranger() -> None:
    """The index has a project `fba` that has nothing to do with this one."""
    told, wrong = 0, []
    for name in tracked():
        path = ROOT / name
        if path == Path(__file__) or path.is_symlink() or not path.is_file():
            continue
        if path.suffix not in (".py", ".md", ".toml", "") and name not in ("dev", ".ci/run"):
            continue
        text = path.read_text(encoding="utf-8")
        for command in INSTALLS.findall(text):
            told += 1
            wrong += [f"{name}: {t}" for t in installed(command) if not (is_ours(t) or is_listed(t))]
        for package in CURES.findall(text):
            told += 1
            wrong += [f"{name}: {package}"] * (not (is_ours(package) or is_listed(package)))
    assert told > 10
    assert set(wrong) == FOREIGN


# --- the script `dev` ---------------------------------------------------------------------------------


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A copy of what `dev` needs, in a folder with a space in its name."""
    path = tmp_path / "a checkout"
    path.mkdir()
    for name in ("dev", "pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, path / name)
    return path


def tools(folder: Path, **scripts: str) -> Path:
    """A PATH with the everyday tools and the given shell scripts, but no Python and no apt."""
    folder.mkdir()
    for name in ("sh", *TOOLS):
        found = shutil.which(name)
        if found:
            (folder / name).symlink_to(found)
    for name, text in scripts.items():
        (folder / name).write_text(f"#!/bin/sh\n{text}\n", encoding="utf-8")
        (folder / name).chmod(0o755)
    return folder


def dev(checkout: Path, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    clean = {k: v for k, v in os.environ.items() if k not in {"FBA_VENV", "PYTHON"}}
    return subprocess.run(
        [checkout / "dev", *arguments],
        cwd=checkout.parent,
        env=clean | environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def test_dev_lists_its_commands(checkout: Path) -> None:
    done = dev(checkout)
    assert done.returncode == 0
    for command in (
        "demo", "test", "lint", "types", "coverage", "bench", "fuzz", "bounds", "docs", "setup", "clean",
    ):  # fmt: skip
        assert f"  {command} " in done.stdout


@pytest.mark.parametrize(
    ("arguments", "python", "said"),
    [
        (["tset"], "", "there is no command 'tset'"),
        (["bench", "my/walk.fba"], "", "to measure the codec on a stream: {}/dev fba bench my/walk.fba"),
        (["test"], "/nowhere/python3", "PYTHON=/nowhere/python3 is no Python 3.11 or later"),
    ],
)
def test_dev_refuses(checkout: Path, arguments: list[str], python: str, said: str) -> None:
    done = dev(checkout, *arguments, **({"PYTHON": python} if python else {}))
    assert done.returncode == 1
    assert said.format(checkout) in done.stderr
    assert not (checkout / ".venv").exists()


def test_dev_without_python_says_how_to_get_one(checkout: Path, tmp_path: Path) -> None:
    done = dev(checkout, "test", PATH=str(tools(tmp_path / "bin", python3="exit 1")))
    assert done.returncode == 1
    assert "no Python 3.11 or later here" in done.stderr
    assert "apt-get install python3" in done.stderr
    assert not (checkout / ".venv").exists()


def test_dev_names_the_package_where_python_cannot_make_environments(checkout: Path, tmp_path: Path) -> None:
    # A Python 3.13 that owns up to its path, and lacks what Debian keeps in a package of its own.
    debian = """case $* in
        *_base_executable*) echo "13 $0" ;;
        *"import ensurepip"*|*"import pip"*) exit 1 ;;
    esac"""
    path = tools(tmp_path / "bin", debian=debian)
    done = dev(checkout, "test", PATH=str(path), PYTHON=str(path / "debian"), FBA_NO_APT="1")
    assert done.returncode == 1
    assert "sudo apt-get install python3.13-venv" in done.stderr
    assert not (checkout / ".venv").exists()


@pytest.mark.parametrize("command", ["setup", "demo"])
def test_dev_says_once_which_libraries_are_missing(checkout: Path, tmp_path: Path, command: str) -> None:
    # A Python 3.13 that installs nothing and cannot load libEGL; its demo says so, as that of fba does.
    python = """case $* in
        *_base_executable*) echo "13 $0" ;;
        *ctypes*) echo libEGL.so.1 ;;
        *"-m venv"*) for last; do :; done; mkdir -p "$last/bin"; cp "$0" "$last/bin/python"
            printf '#!/bin/sh\\necho libEGL.so.1 is missing >&2\\n' >"$last/bin/fba"
            chmod +x "$last/bin/fba" ;;
    esac"""
    path = tools(tmp_path / "bin", python3=python)
    for name in ("chmod", "cp", "date", "env"):
        (path / name).symlink_to(shutil.which(name) or name)
    first = dev(checkout, command, PATH=str(path), FBA_NO_APT="1")
    assert first.returncode == 0, first.stderr
    assert first.stderr.count("libEGL.so.1") == 1
    again = dev(checkout, command, PATH=str(path), FBA_NO_APT="1")
    assert again.stderr.count("libEGL.so.1") == (command == "demo")


def test_dev_leaves_a_folder_alone_that_is_no_environment(checkout: Path, tmp_path: Path) -> None:
    precious = tmp_path / "precious"
    precious.mkdir()
    (precious / "thesis.txt").write_text("years of work", encoding="utf-8")
    for command in ("setup", "clean"):
        done = dev(checkout, command, FBA_VENV=str(precious), PYTHON=sys.executable)
        assert done.returncode == 1
        assert "is no virtual environment" in done.stderr
    assert [p.name for p in precious.iterdir()] == ["thesis.txt"]


@pytest.mark.slow
def test_dev_explains_a_failed_installation_and_starts_again(checkout: Path, tmp_path: Path) -> None:
    offline = {"PIP_NO_INDEX": "1", "PIP_CONFIG_FILE": os.devnull, "PIP_FIND_LINKS": "", "FBA_NO_APT": "1"}
    # What an earlier failure leaves behind: an environment that works, and the mark that it is not finished.
    venv.create(checkout / ".venv", symlinks=True)
    (checkout / ".venv" / ".dev-begun").touch()
    done = dev(checkout, "setup", PYTHON=sys.executable, **offline)
    assert done.returncode == 1
    assert "dev: making " in done.stderr
    assert "dev: the installation failed:" in done.stderr
    assert "hatchling" in done.stderr
    assert (checkout / ".venv" / ".dev-begun").exists()
    assert (checkout / ".venv" / "pyvenv.cfg").exists()
    assert dev(checkout, "clean").returncode == 0
    assert not (checkout / ".venv").exists()


def test_dev_works_through_a_link(checkout: Path, tmp_path: Path) -> None:
    (tmp_path / "links").mkdir()
    (tmp_path / "links" / "dev").symlink_to("../a checkout/dev")
    done = dev(tmp_path / "links", "setup", PYTHON="/nowhere/python3", FBA_VENV="")
    assert "PYTHON=/nowhere/python3" in done.stderr
    done = dev(tmp_path / "links", "clean")
    assert done.returncode == 0
    (checkout / "__pycache__").mkdir()
    assert dev(tmp_path / "links", "clean").returncode == 0
    assert not (checkout / "__pycache__").exists()
