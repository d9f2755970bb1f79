"""Draws the rooms of docs/architecture.md and what they import.

The rooms and their imports are those that tests/test_architecture.py finds. A room stands one row above the
highest room that it imports; an arrow that others imply is left out.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from pathlib import Path

DOCS = Path(__file__).parents[1]
sys.path.insert(0, str(DOCS.parent / "tests"))

from test_architecture import imports, is_facade, modules, reachable  # noqa: E402  # from tests/

WIDTH, ROW, BOX, GAP = 880, 84, (114, 46), 8
COLOURS = {"fba": "#dbe9ff", "fba_player": "#ffe8c9", "fba_conformance": "#dff3dc"}
ABOVE = "fba.face.fitting"  # within a room, but above others that the room itself lies below
CORE = "fba"  # the modules that lie in no room: animation, tracks, errors, compiled ...


def room(module: str) -> str:
    """The room of a module in the drawing: `fba.face` for all that lies below it, `fba_player.gl` ..."""
    parts = module.split(".")
    if module == "fba.player":
        return module
    if module.startswith(ABOVE):
        return ABOVE
    if parts[0] == "fba_conformance":
        return parts[0]
    if len(parts) > 1 and ".".join(parts[:2]) in modules():
        name = ".".join(parts[:2])
        return name if modules()[name].name == "__init__.py" else parts[0]
    return parts[0]


def rooms() -> dict[str, set[str]]:
    """The rooms that each room imports, without façades and without itself."""
    found: dict[str, set[str]] = defaultdict(set)
    for module, targets in imports().items():
        found[room(module)] |= {room(one) for one in targets if not is_facade(module, one)}
    for name in ("fba_player", "fba.__main__"):  # a package's docstring, a starter
        found.pop(name, None)
    found[CORE] = set()
    return {name: {one for one in targets if one in found} - {name} for name, targets in found.items()}


def rows(graph: dict[str, set[str]]) -> dict[str, int]:
    """The row of each room, 0 at the bottom."""
    level: dict[str, int] = dict.fromkeys(graph, 0)
    for _ in graph:
        for name, targets in graph.items():
            level[name] = max((level[one] + 1 for one in targets), default=0)
    return level


def direct(graph: dict[str, set[str]]) -> dict[str, set[str]]:
    """The imports that no other import implies."""
    return {
        name: targets - {far for near in targets for far in reachable(graph, near)}
        for name, targets in graph.items()
    }


def place(level: dict[str, int], arrows: dict[str, set[str]]) -> dict[str, tuple[float, float]]:
    """The centre of each box, in pixels: rooms stand above the middle of what they import."""
    at: dict[str, tuple[float, float]] = {}
    top = max(level.values())
    for row in range(top + 1):
        names = sorted(name for name in level if level[name] == row)
        wish = {
            name: sum(at[one][0] for one in arrows[name]) / len(arrows[name]) if arrows[name] else WIDTH / 2
            for name in names
        }
        names.sort(key=lambda name: (wish[name], name))
        step = BOX[0] + GAP
        x = [wish[name] for name in names]
        for _ in range(200):  # push overlapping neighbours apart
            for left in range(len(x) - 1):
                overlap = step - (x[left + 1] - x[left])
                if overlap > 0:
                    x[left] -= overlap / 2
                    x[left + 1] += overlap / 2
            x = [min(max(one, step / 2), WIDTH - step / 2) for one in x]
        for name, centre in zip(names, x, strict=True):
            at[name] = (centre, (top - row) * ROW + ROW / 2)
    return at


def draw() -> str:
    """The drawing as SVG."""
    graph = rooms()
    level, arrows = rows(graph), direct(graph)
    at = place(level, arrows)
    height = (max(level.values()) + 1) * ROW
    files: dict[str, int] = defaultdict(int)
    for module, path in modules().items():
        files[room(module)] += path.name != "__init__.py"
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" '
        'font-family="sans-serif" font-size="12">',
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" '
        'orient="auto"><path d="M0 0L8 4L0 8z" fill="#788"/></marker></defs>',
        f'<rect width="{WIDTH}" height="{height}" fill="#fff"/>',
    ]
    for name, targets in sorted(arrows.items()):
        for target in sorted(targets):
            (x, y), (u, v) = at[name], at[target]
            y, v = y + BOX[1] / 2, v - BOX[1] / 2
            parts.append(
                f'<path d="M{x:.0f} {y:.0f}C{x:.0f} {y + 26:.0f} {u:.0f} {v - 26:.0f} {u:.0f} {v:.0f}" '
                'fill="none" stroke="#9ab" stroke-width="1.3" marker-end="url(#tip)"/>'
            )
    for name, (x, y) in sorted(at.items()):
        colour = COLOURS[name.split(".", maxsplit=1)[0]]
        left, upper = x - BOX[0] / 2, y - BOX[1] / 2
        label = name.replace("fba_player.", "player: ") if name != CORE else "fba: animation, ..."
        count = f"{files[name]} file{'s' * (files[name] != 1)}" if files[name] else "public names"
        parts += [
            f'<rect x="{left:.0f}" y="{upper:.0f}" width="{BOX[0]}" height="{BOX[1]}" rx="6" '
            f'fill="{colour}" stroke="#567"/>',
            f'<text x="{x:.0f}" y="{y - 3:.0f}" text-anchor="middle" font-weight="bold" '
            f'font-size="{10 if len(label) > 17 else 12}">{label}</text>',
            f'<text x="{x:.0f}" y="{y + 14:.0f}" text-anchor="middle" fill="#456" '
            f'font-size="11">{count}</text>',
        ]
    return "\n".join([*parts, "</svg>", ""])


def main() -> None:
    (DOCS / "images" / "architecture.svg").write_text(draw(), encoding="utf-8")
