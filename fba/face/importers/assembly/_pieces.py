"""From the pieces of a mesh file to the parts of a face: kinds, eyes left and right, skin joined."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import numpy.typing as npt

from fba.arrays import Bool, Float32, Float64
from fba.errors import ModelError, OptionError
from fba.face.eyeball import flat_width
from fba.face.importers.assembly._joining import join_pieces
from fba.face.importers.assembly._polygon_parts import Piece, vertex_components
from fba.face.model import PART_KINDS
from fba.mesh import UniqueNames
from fba.text_files import packaged_rows

DROPPED = "none"
"""Kind of parts that are left out: transparent shells in front of the eye, which would hide it."""
EYE_ROUND = 0.1
"""Root mean square distance of an eyeball's vertices from their sphere, by its radius."""
MIN_SINGLE_TEETH = 6
"""Number of pieces from which they are single teeth rather than rows."""
FRONT_SHARE = 0.25
"""Share of the depth of a row of teeth in which the front teeth lie."""
MAX_HEIGHT_DIFFERENCE = 0.6
"""Share of their height by which the middles of front teeth of one jaw differ at most."""
MIN_PAIR_ASPECT = 1.7
"""Two eyes are together at least this many times as wide as tall; one eye is round."""
WHITE = re.compile("white|sclera", re.IGNORECASE)
"""Part of the names of the whites of eyes."""
LID_RADII = (0.7, 2.0)
"""Least and greatest distance, in radii, at which the lids around an eyeball have vertices."""
SIDES_OF_EYE = 3
"""Lids have vertices on at least this many of an eyeball's four sides."""
EYE_SIZES = (0.02, 0.12)
"""Radius of an eyeball by the height of the mesh, head alone to head and shoulders."""


def assemble(
    pieces: Sequence[Piece], kinds: Mapping[str, str] | None = None, *, middle: float | None = None
) -> tuple[Piece, ...]:
    """Return a face's parts: kinds from names, all skin in one, each eyeball in one, two rows of teeth.

    kinds: what the user says, by the name of a group, object, mesh or material. middle: the x of the
    plane between left and right, by default between the eyes. Where names do not say, round shells in pairs
    are eyes and the largest piece is skin. Raises ModelError where nothing is left.
    """
    given = check_kinds(kinds)
    guessed: list[tuple[Piece, str | None]] = []
    for piece in pieces:
        kind = kind_of(piece, given)
        if kind != DROPPED:
            guessed.append((piece, kind))
    if not guessed:
        raise ModelError("no part of the mesh is left: all are named as transparent shells of the eye")
    guessed = [(piece, "other" if _is_white(piece, kind, guessed) else kind) for piece, kind in guessed]
    unknown = [piece for piece, kind in guessed if kind is None or kind == "skin"]
    if not any(kind == "eye" for _, kind in guessed):
        known = {id(piece): kind for piece, kind in guessed}
        guessed = [pair for pair in guessed if pair[1] is not None and pair[1] != "skin"]
        guessed += _with_eyes(unknown, known, middle)
    if not any(kind == "skin" for _, kind in guessed):
        largest = max((len(p.part.vertices) for p, kind in guessed if kind is None), default=0)
        guessed = [
            (p, "skin" if kind is None and len(p.part.vertices) == largest else kind) for p, kind in guessed
        ]
    if middle is None:
        middle = _middle(guessed)
    return _join_by_kind([(p, kind or "other") for p, kind in guessed], middle)


def _is_white(piece: Piece, kind: str | None, pieces: Sequence[tuple[Piece, str | None]]) -> bool:
    """Return whether a piece is the white of drawn eyes, which stays while their irises turn."""
    whites = [
        own for own, each in pieces if each == "eye" and WHITE.search(f"{own.part.name} {own.material}")
    ]
    if kind != "eye" or piece not in whites or len(whites) == sum(each == "eye" for _, each in pieces):
        return False
    size, middle = np.ptp(piece.part.vertices, axis=0), _centre([piece.part.vertices])
    of_one = (
        [piece]
        if size[0] < MIN_PAIR_ASPECT * size[1]
        else _side([piece], lambda centres: centres[:, 0] > middle)
    )
    return all(flat_width(eye.part) is not None for eye in of_one)


def _middle(pieces: Sequence[tuple[Piece, str | None]]) -> float:
    """Return the x between the eyes; where there are not two, of the middle of the skin."""
    eyes = [piece.part.vertices for piece, kind in pieces if kind == "eye"]
    if eyes:
        size = np.ptp(np.concatenate(eyes), axis=0)
        if size[0] > MIN_PAIR_ASPECT * size[1]:
            return _centre(eyes)
    skin = [piece.part.vertices for piece, kind in pieces if kind == "skin"]
    return _centre(skin) if skin else 0.0


def _centre(vertices: Sequence[Float32]) -> float:
    """Return the x of the middle between the outermost of some vertices, arrays (V, 3)."""
    across = np.concatenate(vertices)[:, 0]
    return float(across.min() + across.max()) / 2


def shift_piece(piece: Piece, scale: float, shift: npt.ArrayLike) -> Piece:
    """Return the piece scaled, then shifted."""
    vertices = piece.part.vertices.astype(np.float64) * scale + np.asarray(shift)
    part = replace(piece.part, vertices=vertices.astype(np.float32))
    return replace(piece, part=part, morphs={name: m * np.float32(scale) for name, m in piece.morphs.items()})


def turn_pieces(pieces: Sequence[Piece], turn: Float64, about: Float64 | None = None) -> list[Piece]:
    """Return the pieces turned by a matrix (3, 3), about a point (3,) or the origin."""
    result = []
    for piece in pieces:
        part = piece.part
        placed = part.vertices @ turn.T if about is None else (part.vertices - about) @ turn.T + about
        normals = None if part.normals is None else (part.normals @ turn.T).astype(np.float32)
        part = replace(part, vertices=placed.astype(np.float32), normals=normals)
        morphs = {name: (morph @ turn.T).astype(np.float32) for name, morph in piece.morphs.items()}
        result.append(replace(piece, part=part, morphs=morphs))
    return result


def _with_eyes(
    pieces: Sequence[Piece], kinds: Mapping[int, str | None], middle: float | None
) -> list[tuple[Piece, str | None]]:
    """Return the pieces, with mirrored pairs of round components split off as eyes.

    middle: the x of the mirror; without it, that of x = 0 and that in the middle of the pieces are tried.
    """
    from fba.face.eyeball import sphere

    if not pieces:
        return []
    heights = np.concatenate([piece.part.vertices[:, 1] for piece in pieces])
    tall = max(float(np.ptp(heights)), 1e-9)
    spheres: list[tuple[int, int, Float64, float]] = []
    labels = [vertex_components(piece.part.triangles, piece.part.vertices) for piece in pieces]
    for number, (piece, label) in enumerate(zip(pieces, labels, strict=True)):
        sizes = np.bincount(label)
        for shell in np.flatnonzero((sizes >= 20) & (sizes < len(heights) / 2))[:500]:
            fit = sphere(_cut(piece, label == shell, f"shell {shell}").part)
            if fit is None:
                continue
            centre, radius, error, share = fit
            if error < EYE_ROUND * radius and share > 0.5 and EYE_SIZES[0] < radius / tall < EYE_SIZES[1]:
                spheres.append((number, int(shell), centre, radius))
    others = [~np.isin(label, [s[1] for s in spheres if s[0] == k]) for k, label in enumerate(labels)]
    around = np.concatenate([piece.part.vertices[own] for piece, own in zip(pieces, others, strict=True)])
    spheres = [s for s in spheres if _is_set_in(around, s[2], s[3])] or spheres
    eyes: set[tuple[int, int]] = set()
    for plane in (0.0, _centre([piece.part.vertices for piece in pieces])) if middle is None else (middle,):
        for a in spheres if not eyes else ():
            mirror = a[2] * (-1, 1, 1) + (2 * plane, 0, 0)
            if any(b[:2] != a[:2] and np.linalg.norm(b[2] - mirror) < 0.5 * a[3] for b in spheres):
                eyes.add(a[:2])
    result: list[tuple[Piece, str | None]] = []
    for number, (piece, label) in enumerate(zip(pieces, labels, strict=True)):
        mask = np.isin(label, [shell for index, shell in eyes if index == number])
        if mask.any():
            result.append((_cut(piece, mask, f"{piece.part.name} eyes"), "eye"))
        if not mask.all():
            rest = _cut(piece, ~mask, piece.part.name) if mask.any() else piece
            result.append((rest, kinds[id(piece)]))
    return result


def _is_set_in(vertices: Float32, centre: Float64, radius: float) -> bool:
    """Return whether vertices (N, 3) lie around a ball on most sides, as lids do; a bun of hair has none."""
    x, y, z = ((vertices - centre) / radius).T
    far = np.hypot(x, y)
    near = (far > LID_RADII[0]) & (far < LID_RADII[1]) & (np.abs(z) < LID_RADII[1])
    sides = (y > np.abs(x), -y > np.abs(x), x >= np.abs(y), -x >= np.abs(y))
    return sum(bool((near & side).any()) for side in sides) >= SIDES_OF_EYE


def _join_by_kind(pieces: Sequence[tuple[Piece, str]], middle: float) -> tuple[Piece, ...]:
    """Return one piece for each side or row of skin, eyes, brows, lashes and mouth; others as they are."""
    result: list[Piece] = []

    def add(kind: str, name: str, own: Sequence[Piece]) -> None:
        if own:
            result.append(join_pieces(own, name, kind))

    def of_kind(kind: str) -> list[Piece]:
        return [piece for piece, each in pieces if each == kind]

    add("skin", "skin", of_kind("skin"))
    for kind, left, right in (
        ("eye", "left eye", "right eye"),
        ("brow", "left brow", "right brow"),
        ("lash", "left lashes", "right lashes"),
    ):
        add(kind, left, _side(of_kind(kind), lambda centres: centres[:, 0] > middle))
        add(kind, right, _side(of_kind(kind), lambda centres: centres[:, 0] <= middle))
    teeth = of_kind("teeth")
    if teeth and _are_one_row(teeth):
        add("teeth", "upper teeth", teeth)
    elif teeth:
        levels = np.concatenate([piece.part.vertices[:, 1] for piece in teeth])
        between = float(levels.min() + levels.max()) / 2
        add("teeth", "upper teeth", _side(teeth, lambda centres: centres[:, 1] > between))
        add("teeth", "lower teeth", _side(teeth, lambda centres: centres[:, 1] <= between))
    for kind in ("tongue", "mouth"):
        add(kind, kind, of_kind(kind))
    unused = part_names(piece.part.name for piece in result)
    for piece, kind in pieces:
        if kind in ("hair", "other"):
            name = unused(piece.part.name)
            result.append(replace(piece, part=replace(piece.part, name=name, kind=kind)))
    return tuple(result)


def _are_one_row(teeth: Sequence[Piece]) -> bool:
    """Return whether teeth are of one jaw only: then those in front lie at one height."""
    lows, highs, fronts = [], [], []
    for piece in teeth:
        vertices = piece.part.vertices
        label = vertex_components(piece.part.triangles, vertices)
        for shell in range(int(label.max()) + 1):
            own = vertices[label == shell]
            lows.append(float(own[:, 1].min()))
            highs.append(float(own[:, 1].max()))
            fronts.append(float(own[:, 2].max()))
    if len(lows) < MIN_SINGLE_TEETH:
        return False
    low, high, front = np.array(lows), np.array(highs), np.array(fronts)
    foremost = front > front.max() - FRONT_SHARE * (front.max() - front.min())
    middles = (low + high)[foremost] / 2
    return bool(np.ptp(middles) < np.median((high - low)[foremost]) * MAX_HEIGHT_DIFFERENCE)


def _side(pieces: Sequence[Piece], wanted: Callable[[Float64], Bool]) -> list[Piece]:
    """Return the components whose centres (N, 3) are `wanted` (bool (N,)), of each piece."""
    result = []
    for piece in pieces:
        vertices = piece.part.vertices
        label = vertex_components(piece.part.triangles, vertices)
        order = np.argsort(label, kind="stable")
        starts = np.flatnonzero(np.diff(label[order], prepend=-1))
        ordered = vertices[order].astype(np.float64)
        centres = (np.minimum.reduceat(ordered, starts) + np.maximum.reduceat(ordered, starts)) / 2
        mask = wanted(centres)[label]
        if mask.any():
            result.append(piece if mask.all() else _cut(piece, mask, piece.part.name))
    return result


def _cut(piece: Piece, mask: Bool, name: str) -> Piece:
    """Return the vertices of a mask, with the triangles that have all corners among them."""
    part = piece.part
    number = np.cumsum(mask) - 1
    triangles = number[part.triangles[mask[part.triangles].all(axis=1)]].astype(np.int32)

    cut = replace(
        part,
        name=name,
        vertices=part.vertices[mask],
        triangles=triangles,
        normals=None if part.normals is None else part.normals[mask],
        texcoords=None if part.texcoords is None else part.texcoords[mask],
        colours=None if part.colours is None else part.colours[mask],
    )
    origin = piece.origin[mask] if len(piece.origin) else piece.origin
    morphs = {shape: morph[mask] for shape, morph in piece.morphs.items()}
    return replace(piece, part=cut, origin=origin, morphs=morphs)


def part_names(taken: Iterable[str] = ()) -> UniqueNames:
    """Return the names for the parts of a face; "head" is reserved: it stands for all parts."""
    return UniqueNames(("head", *taken))


@cache
def _words() -> tuple[tuple[str, str], ...]:
    return tuple((row["word"], row["kind"]) for row in packaged_rows(__package__, "kinds.csv"))


def guess_kind(*names: str) -> str | None:
    """Return the kind of a part by its names, the most specific first; None where no name is known.

    The first word of `kinds.csv` that is in a name decides; "ear" and "hat" must be words of their own,
    as they are inside "pearl" and "that".
    """
    for name in names:
        parts = {part.lower() for part in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)}
        plain = re.sub(r"[^a-z]", "", name.lower())
        for word, kind in _words():
            if word in parts or word + "s" in parts or (len(word) > 4 and word in plain):
                return kind
    return None


def kind_of(piece: Piece, given: Mapping[str, str]) -> str | None:
    """Return the kind that a user gave by a piece's name or material, else that of its names, or None."""
    kind = given.get(piece.part.name, given.get(piece.material))
    return guess_kind(piece.part.name, piece.material) if kind is None else kind


def check_kinds(kinds: Mapping[str, str] | None) -> dict[str, str]:
    """Return the kinds that a user gave by name; OptionError for one that does not exist."""
    for name, kind in (kinds or {}).items():
        if kind not in PART_KINDS and kind != DROPPED:
            raise OptionError(f"kind of {name!r}: {kind!r} is not one of {', '.join((*PART_KINDS, DROPPED))}")
    return dict(kinds or {})
