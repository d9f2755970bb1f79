"""The house: imports point down, no circles, private modules stay in their room, no room is too full.

A floor is a room (a package) or a single module of one. A module belongs to the floor with the longest name
that it begins with, and imports only from its own floor and from those below. All imports count: lazy ones,
those for type checkers, and modules named in a string.
"""

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = {
    "fba": ROOT / "fba",
    "fba_player": ROOT / "player/fba_player",
    "fba_conformance": ROOT / "conformance/fba_conformance",
}
MOST_FILES = 20
"""Modules in a folder, its `__init__` not counted."""

_FLOORS = """
fba.arrays
fba.geometry
fba.parameters
fba
fba.mesh
fba.mesh.simplify
fba.gltf
fba.codec.settings
fba.codec._plane
fba.codec._stream
fba.codec
fba.audio
fba.serving
fba.carriage
fba.face.interpolation
fba.face
fba.face.deform
fba.face.learning
fba.face.gltf
fba.face.builtin
fba.face.authoring.surface
fba.face.authoring.regions
fba.face.authoring._author
fba.face.authoring._shapes
fba.face.authoring
fba.face.checks
fba.face.importers.assembly
fba.face.simplification
fba.face.importers.points
fba.face.importers.makehuman
fba.face.importers
fba.face.calibration
fba.body._skeleton
fba.body.solve
fba.body.skin
fba.body
fba.body.simplification
fba.body.builtin
fba.figures
fba.body.gait
fba.body.importers
fba.planning
fba.planning.rate
fba.planning._encoding
fba.capture.markers
fba.capture.virtual_markers
fba.capture.motion
fba.capture._limbs
fba.capture.comparison
fba.capture.blendshapes
fba.capture.points
fba.capture
fba.capture.live
fba.emotion
fba.speech
fba.outlines
fba.formats
fba.formats.text
fba.formats.epf
fba.formats.bvh
fba.formats.smpl
fba.formats.markers
fba.formats.c3d
fba.formats.gltf
fba.formats.face_tables
fba.formats.avatar
fba.face.fitting
fba.live._protocols
fba.live
fba.archive
fba.persona.points
fba.persona.recognition
fba.persona
fba_conformance
fba_conformance.suite
fba_player._mesh
fba_player.view
fba_player._figure
fba_player.web
fba_player.playback
fba_player.scene
fba_player.gl
fba_player.sound
fba_player.export
fba_player.session
fba_player._ui.theme
fba_player._ui.ruler
fba_player._ui.panels
fba_player._ui
fba_player.window
fba_player
fba.player
fba.cli
fba.cli.recordings
fba.cli.coding
fba.cli.subcommands
fba.cli.commands
fba.cli.commands.live
fba.cli.commands.archives
fba.__main__
"""
FLOORS = _FLOORS.split()
"""From the ground up."""

FOLLOWED_BY_A_NAME = ("fba.cli.commands.",)
"""Beginnings of module names that are put together while the program runs."""

FACADES = {
    ("fba", "*"): "the public names of the library, imported where they are first used",
    ("fba.face", "*"): "public names of the face",
    ("fba.body", "*"): "public names of the body",
    ("fba.formats._registry", "fba.formats.*"): "the table of formats: readers and writers by name",
    ("fba.planning", "fba.planning._encoding"): "the function over all ways to encode, bit rates among them",
    ("fba.cli.main", "fba.cli.commands.*"): "the subcommands by name",
    ("fba.face.model", "fba.face.gltf._storage"): "`FaceModel.load` and `save`",
    ("fba.face.model", "fba.face.builtin"): "`FaceModel.default`",
    ("fba.body._model", "fba.body._storage"): "`BodyModel.load` and `save`",
    ("fba.body._model", "fba.body.builtin"): "`BodyModel.default`",
}
"""Imports that may point up, and why."""


@cache
def modules() -> dict[str, Path]:
    """Every module by its dotted name; a package by its own."""
    result = {}
    for package, folder in PACKAGES.items():
        for path in folder.rglob("*.py"):
            parts = [package, *path.relative_to(folder).with_suffix("").parts]
            result[".".join(parts).removesuffix(".__init__")] = path
    return result


def is_package(module: str) -> bool:
    return modules()[module].name == "__init__.py"


def room(module: str) -> str:
    return module if is_package(module) else module.rpartition(".")[0]


@cache
def imports() -> dict[str, set[str]]:
    """What each module imports of ours."""
    return {module: set(imported(module)) - {module} for module in modules()}


def imported(module: str) -> Iterator[str]:
    for node in ast.walk(ast.parse(modules()[module].read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}: a relative import"
            for alias in node.names:
                name = f"{node.module}.{alias.name}"
                yield from (one for one in (name if name in modules() else node.module,) if one in modules())
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in modules())
        elif isinstance(node, ast.JoinedStr) and isinstance(node.values[0], ast.Constant):
            begin = str(node.values[0].value)  # import_module(f"fba.cli.commands.{name}")
            yield from (one for one in modules() if begin in FOLLOWED_BY_A_NAME and one.startswith(begin))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            name = node.value.partition(":")[0]
            yield from (one for one in (name, f"fba.formats.{name}") if "." in name and one in modules())


def floor(module: str) -> int:
    names = [name for name in FLOORS if module == name or module.startswith(name + ".")]
    return FLOORS.index(max(names, key=len))


def is_facade(importer: str, target: str) -> bool:
    names = [other for one, other in FACADES if one == importer]
    return any(target == name or (name[-1] == "*" and target.startswith(name[:-1])) for name in names)


def test_the_floors_are_rooms_or_modules() -> None:
    assert [name for name in FLOORS if name not in modules()] == []
    assert len(set(FLOORS)) == len(FLOORS)
    assert {room(module) for module in modules() if not is_package(module)} <= set(FLOORS)


def test_imports_point_down() -> None:
    up = [
        f"{module} imports {target}"
        for module, targets in sorted(imports().items())
        for target in sorted(targets)
        if floor(target) > floor(module) and not is_facade(module, target)
    ]
    assert up == []


def test_every_facade_is_one() -> None:
    for importer, target in FACADES:
        assert any(
            is_facade(importer, one) and floor(one) > floor(importer) for one in imports()[importer]
        ), f"{importer} does not import {target} upwards: take it off the list"


def test_no_modules_import_each_other_in_a_circle() -> None:
    graph = {
        module: {target for target in targets if not is_facade(module, target) and not is_package(target)}
        for module, targets in imports().items()
        if not is_package(module)
    }
    assert circles(graph) == []


def circles(graph: dict[str, set[str]]) -> list[list[str]]:
    """Groups of modules that reach each other."""
    reached = {module: reachable(graph, module) for module in graph}
    groups = {
        tuple(sorted(one for one in reached[module] if module in reached.get(one, ())))
        for module in graph
        if module in reached[module]
    }
    return [list(group) for group in sorted(groups)]


def reachable(graph: dict[str, set[str]], module: str) -> set[str]:
    found: set[str] = set()
    open_ends = [module]
    while open_ends:
        for target in graph.get(open_ends.pop(), ()):
            if target not in found:
                found.add(target)
                open_ends.append(target)
    return found


def house_room(module: str) -> str:
    """The room that shares private modules: a package of `fba` with all in it, or another package."""
    parts = module.split(".")
    if parts[0] != "fba":
        return parts[0]
    return ".".join(parts[:2]) if len(parts) > 2 or is_package(module) else "fba"


def is_private(module: str) -> bool:
    return any(part.startswith("_") for part in module.split("."))


def test_private_modules_are_imported_by_their_room_only() -> None:
    wrong = [
        f"{module} imports {target}"
        for module, targets in imports().items()
        for target in targets
        if is_private(target) and house_room(module) != house_room(target)
    ]
    assert wrong == []


def test_modules_that_no_other_room_uses_are_private() -> None:
    """A module without an underscore is one that other rooms import, or that a page or an example names."""
    used = {
        target
        for module, targets in imports().items()
        for target in targets
        if house_room(module) != house_room(target)
    }
    files = [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), *(ROOT / "examples").rglob("*.py")]
    pages = "\n".join(path.read_text(encoding="utf-8") for path in files)
    named: set[str] = set()
    for name in re.findall(r"(?<![\w.])fba\w*(?:\.\w+)+", pages):
        parts = name.split(".")
        named |= {".".join(parts[:end]) for end in range(1, len(parts) + 1)}
    public = [
        module
        for module in modules()
        if module.count(".") > 1
        and not is_package(module)
        and not is_private(module)
        and not module.startswith("fba.cli.")
        and not module.endswith("__main__")
    ]
    assert [module for module in public if module not in used | named] == []


@pytest.mark.parametrize("package", PACKAGES)
def test_no_room_is_too_full(package: str) -> None:
    rooms: dict[str, int] = defaultdict(int)
    for module in modules():
        if module.split(".")[0] == package and not is_package(module):
            rooms[room(module)] += 1
    assert {name: count for name, count in rooms.items() if count > MOST_FILES} == {}


def test_no_folder_of_tests_is_too_full() -> None:
    files: dict[str, int] = defaultdict(int)
    for path in (ROOT / "tests").rglob("*.py"):
        files[path.parent.relative_to(ROOT).as_posix()] += 1
    assert {name: count for name, count in files.items() if count > MOST_FILES} == {}


@pytest.mark.parametrize("package", PACKAGES)
def test_every_room_says_what_it_holds(package: str) -> None:
    for module in modules():
        if module.split(".")[0] == package and is_package(module):
            text = ast.get_docstring(ast.parse(modules()[module].read_text(encoding="utf-8"))) or ""
            assert len(re.findall(r"\w+", text)) >= 5, f"{module} says too little of itself"
