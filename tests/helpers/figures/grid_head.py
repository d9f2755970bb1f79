"""A head made of a bent grid for tests: a mask with eye holes, a slit mouth, ears; eyeballs, teeth, tongue.

About 3,000 vertices, symmetric, all 84 feature points of `adult.csv` on vertices of their own.
"""

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import spsolve

from fba.face.feature_points import MIRRORED
from fba.face.model import Part
from fba.parameters import point_rows
from small_head import adult_points, ball

COLUMNS, ROWS = 57, 67
WIDTH, BOTTOM, TOP = 0.084, -0.128, 0.085
EYE_RADIUS = 0.0122
EYE_HALF = (4, 2)
"""Cells from the middle of an eye's hole to its corner and to its lid."""
FACE_POINTS = [
    name
    for name in point_rows()
    if name.split(".")[0] in {"2", "3", "4", "5", "8", "9", "11"}
    and name not in {"3.5", "3.6", "9.8", "9.9", "9.10", "9.11", "11.4", "11.5", "11.6"}
]
EAR_POINTS = [name for name in point_rows() if name.startswith("10.")]
LIDS = {"left": ("3.11", "3.1", "3.7", "3.3"), "right": ("3.8", "3.2", "3.12", "3.4")}
LOWER_LIP = ("2.3", "2.8", "2.9")


def grid_head(*, eyes: bool = True, mouth: bool = True) -> tuple[list[Part], np.ndarray, np.ndarray]:
    """(parts, points (84, 3), bound (84,)); bound is -1 for 7.1, 11.4, 11.5, 11.6 only.

    eyes, mouth: whether there are eyeballs, and teeth and tongue.
    """
    points = adult_points().copy()
    row = point_rows()
    skin, vertex = _mask(points)
    parts = [skin]
    bound = np.full(len(row), -1)
    for name, number in vertex.items():
        bound[row[name]] = number
        points[row[name]] = skin.vertices[number]
    if eyes:
        for side, name in (("left", "3.5"), ("right", "3.6")):
            vertices, triangles = ball(points[row[name]] - (0, 0, EYE_RADIUS), EYE_RADIUS, rings=36)
            bound[row[name]] = sum(len(p.vertices) for p in parts) + int(vertices[:, 2].argmax())
            parts.append(Part(f"{side} eye", "eye", vertices, triangles))
    if mouth:
        for part, own in _inside(points):
            start = sum(len(p.vertices) for p in parts)
            parts.append(part)
            for name, number in own.items():
                bound[row[name]] = start + number
                points[row[name]] = part.vertices[number]
    return parts, points, bound


def _mask(points: np.ndarray) -> tuple[Part, dict[str, int]]:
    row = point_rows()
    xs, ys = np.linspace(-WIDTH, WIDTH, COLUMNS), np.linspace(BOTTOM, TOP, ROWS)
    plane = np.stack(np.meshgrid(xs, ys), axis=-1).reshape(-1, 2)
    number = np.arange(ROWS * COLUMNS).reshape(ROWS, COLUMNS)
    middle = COLUMNS // 2
    fixed: dict[int, np.ndarray] = {}
    hole = np.zeros((ROWS - 1, COLUMNS - 1), dtype=bool)
    vertex: dict[str, int] = {}

    for names, sign in ((LIDS["left"], 1), (LIDS["right"], -1)):
        inner, top, outer, bottom = (points[row[name], :2] for name in names)
        centre = (inner + outer) / 2
        across, up = EYE_HALF
        column = middle + sign * round(abs(centre[0]) / (xs[1] - xs[0]))
        line = int(np.abs(ys - centre[1]).argmin())
        hole[line - up : line + up, column - across : column + across] = True
        ring = _ring(line, column, across, up, sign)
        for k, (i, j) in enumerate(ring):
            fixed[int(number[i, j])] = _on_lids(k / len(ring), inner, top, outer, bottom)
        for k, name in enumerate(names):
            vertex[name] = int(number[ring[k * len(ring) // 4]])

    slit = int(np.abs(ys - points[row["2.2"], 1]).argmin())
    corner = round(points[row["2.4"], 0] / (xs[1] - xs[0]))
    for j in range(-corner, corner + 1):
        x = points[row["2.4"], 0] * j / corner
        fixed[int(number[slit, middle + j])] = np.array([x, points[row["2.2"], 1]])
    for name, j in (
        ("2.4", corner),
        ("2.5", -corner),
        ("2.2", 0),
        ("2.6", corner // 2),
        ("2.7", -(corner // 2)),
    ):
        vertex[name] = int(number[slit, middle + j])

    for name in FACE_POINTS:
        if name in vertex or name in LOWER_LIP or name in MIRRORED.values():
            continue
        goal = points[row[name], :2]
        away = np.linalg.norm(plane - goal, axis=1)
        away[[*fixed]] = np.inf
        if abs(goal[0]) > 1e-9:
            away[number[:, : middle + 1].ravel()] = np.inf
        else:
            away[np.setdiff1d(number, number[:, middle])] = np.inf
        nearest = int(away.argmin())
        i, j = divmod(nearest, COLUMNS)
        vertex[name], fixed[nearest] = nearest, goal
        if name in MIRRORED:
            mirror = int(number[i, 2 * middle - j])
            vertex[MIRRORED[name]], fixed[mirror] = mirror, goal * (-1, 1)
    rim = np.concatenate([number[0], number[-1], number[:, 0], number[:, -1]])
    fixed |= {int(v): plane[v] for v in rim if int(v) not in fixed}
    plane = _relaxed(plane, number, fixed)

    triangles = _triangles(number, hole)
    # the lower lip's own vertices along the slit
    between = number[slit, middle - corner + 1 : middle + corner]
    twin = {int(v): len(plane) + k for k, v in enumerate(between)}
    below = triangles // COLUMNS
    lower = below.min(axis=1) < slit
    triangles[lower] = np.vectorize(lambda v: twin.get(v, v))(triangles[lower])
    plane = np.vstack([plane, plane[between]])
    for name, upper in (("2.3", "2.2"), ("2.8", "2.6"), ("2.9", "2.7")):
        vertex[name] = twin[vertex[upper]]

    known = np.array(
        [[*plane[v], points[row[name], 2]] for name, v in vertex.items() if name not in LOWER_LIP]
    )
    edge = np.array([[x, y, -0.09] for x in (-WIDTH, WIDTH) for y in np.linspace(BOTTOM, TOP, 6)])
    known = np.vstack([known, edge])
    depth = RBFInterpolator(known[:, :2], known[:, 2], kernel="thin_plate_spline", smoothing=1e-9)
    skin = np.column_stack([plane, depth(plane)])
    for name, v in vertex.items():
        skin[v, 2] = points[row[name], 2]
    for lids in LIDS.values():
        for name in lids:
            del name
    skin = _off_eyes(skin, points, fixed, vertex)
    used = np.unique(triangles)
    renumbered = np.full(len(skin), -1)
    renumbered[used] = np.arange(len(used))
    skin, triangles = skin[used], renumbered[triangles]
    vertex = {name: int(renumbered[v]) for name, v in vertex.items()}
    skin, triangles, ears = _with_ears(skin, triangles, points)
    return Part("skin", "skin", skin, triangles), vertex | ears


def _ring(line: int, column: int, across: int, up: int, sign: int) -> list[tuple[int, int]]:
    """The hole's rim from the inner corner over the upper lid: 4 equal runs between the four points."""
    inner, outer = column - sign * across, column + sign * across
    upper = [(line + k, inner) for k in range(up)]
    upper += [(line + up, inner + sign * k) for k in range(2 * across)]
    upper += [(line + up - k, outer) for k in range(up)]
    lower = [(2 * line - i, 2 * column - j) for i, j in upper]
    return upper + lower


def _on_lids(
    share: float, inner: np.ndarray, top: np.ndarray, outer: np.ndarray, bottom: np.ndarray
) -> np.ndarray:
    """A place on the opening's outline, which is through its four points a quarter of the way each."""
    corners = [inner, top, outer, bottom, inner]
    k, t = divmod(share * 4, 1)
    start, end = corners[int(k)], corners[int(k) + 1]
    turn = t * np.pi / 2
    # a quarter of an ellipse, upright at the corners, level at the lids
    rising = int(k) % 2 == 0
    x = start[0] + (end[0] - start[0]) * (1 - np.cos(turn) if rising else np.sin(turn))
    y = start[1] + (end[1] - start[1]) * (np.sin(turn) if rising else 1 - np.cos(turn))
    return np.array([x, y])


def _relaxed(plane: np.ndarray, number: np.ndarray, fixed: dict[int, np.ndarray]) -> np.ndarray:
    """The grid with some vertices put elsewhere and the others evenly between them."""
    pairs = np.concatenate(
        [
            np.stack([number[:, :-1], number[:, 1:]], -1).reshape(-1, 2),
            np.stack([number[:-1], number[1:]], -1).reshape(-1, 2),
        ]
    )
    both = np.concatenate([pairs, pairs[:, ::-1]])
    graph = csr_array((np.ones(len(both)), tuple(both.T)), shape=(len(plane),) * 2)
    laplacian = (diags_array(graph.sum(axis=1)) - graph).tocsr()
    held = np.array(sorted(fixed))
    moved = plane.copy()
    moved[held] = [fixed[v] for v in held]
    free = np.setdiff1d(np.arange(len(plane)), held)
    # displacements, not places, are spread evenly: far from the fixed vertices the grid stays a grid
    shift = moved - plane
    shift[free] = spsolve(laplacian[free][:, free].tocsc(), -(laplacian[free][:, held] @ shift[held]))
    return plane + shift


def _triangles(number: np.ndarray, hole: np.ndarray) -> np.ndarray:
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    left = np.zeros_like(hole)
    left[:, : hole.shape[1] // 2] = True
    one = np.where(left[..., None], np.stack([a, b, c], -1), np.stack([a, b, d], -1))
    two = np.where(left[..., None], np.stack([a, c, d], -1), np.stack([b, c, d], -1))
    return np.concatenate([one[~hole], two[~hole]])


def _off_eyes(
    skin: np.ndarray, points: np.ndarray, fixed: dict[int, np.ndarray], vertex: dict[str, int]
) -> np.ndarray:
    """Lids laid on their eyeballs, with some room; nothing else within them."""
    del fixed
    result = skin.copy()
    for name in ("3.5", "3.6"):
        centre = points[point_rows()[name]] - (0, 0, EYE_RADIUS)
        arm = skin - centre
        flat = np.hypot(arm[:, 0], arm[:, 1])
        reach = 1.04 * EYE_RADIUS
        front = np.sqrt(np.maximum(reach**2 - flat**2, 0.0))
        low = (flat < reach) & (arm[:, 2] < front)
        result[low, 2] = centre[2] + front[low]
    del vertex
    return result


def _with_ears(
    skin: np.ndarray, triangles: np.ndarray, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray, dict[str, int]]:
    """Two flaps that stand off the sides of the mask, hung on its rim."""
    row, vertex = point_rows(), {}
    for side, names in (
        ("left", ("10.1", "10.3", "10.5", "10.7", "10.9")),
        ("right", ("10.2", "10.4", "10.6", "10.8", "10.10")),
    ):
        top, back, lobe, below, above = (points[row[name]] for name in names)
        x = WIDTH if side == "left" else -WIDTH
        rim = np.flatnonzero(
            (np.abs(skin[:, 0] - x) < 1e-9) & (skin[:, 1] > below[1]) & (skin[:, 1] < above[1])
        )
        rim = rim[np.argsort(skin[rim, 1])]
        share = np.linspace(0, 1, len(rim))
        outer = np.array(
            [
                _through([lobe, (lobe + back) / 2 + (0, 0, -0.004), back, (back + top) / 2, top], s)
                for s in share
            ]
        )
        steps = 5
        start = len(skin)
        sheets = [skin[rim] * (1 - t) + outer * t for t in np.linspace(0, 1, steps + 1)[1:]]
        index = np.vstack([rim, start + np.arange(steps * len(rim)).reshape(steps, -1)])
        a, b, c, d = (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:])
        faces = np.concatenate(
            [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)]
        )
        skin = np.vstack([skin, *sheets])
        triangles = np.vstack([triangles, faces if side == "left" else faces[:, ::-1]])
        count = len(rim)
        last = start + (steps - 1) * count
        vertex |= {names[0]: last + count - 1, names[1]: last + count // 2, names[2]: last}
        vertex |= {names[3]: int(rim[0]), names[4]: int(rim[-1])}
    return skin, triangles, vertex


def _through(line: list[np.ndarray], share: float) -> np.ndarray:
    k = min(int(share * (len(line) - 1)), len(line) - 2)
    t = share * (len(line) - 1) - k
    return line[k] * (1 - t) + line[k + 1] * t


def _inside(points: np.ndarray) -> list[tuple[Part, dict[str, int]]]:
    row = point_rows()
    found = []
    for jaw, edge, root in (("upper", "9.10", "9.8"), ("lower", "9.11", "9.9")):
        turn = np.linspace(-1.2, 1.2, 25)
        arch = np.stack([0.024 * np.sin(turn), 0 * turn, 0.03 * (np.cos(turn) - 1)], axis=1)
        rows = [points[row[edge]] * (1 - t) + points[row[root]] * t + arch for t in (0, 0.5, 1)]
        index = np.arange(75).reshape(3, 25)
        a, b, c, d = (index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1])
        faces = np.concatenate(
            [np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)]
        )
        part = Part(f"{jaw} teeth", "teeth", np.vstack(rows), faces if jaw == "upper" else faces[:, ::-1])
        found.append((part, {edge: 12, root: 62}))
    vertices, triangles = ball((0, 0, 0), 1.0, rings=12)
    size = np.array([points[row["6.3"], 0], 0.003, points[row["6.1"], 2] - points[row["6.2"], 2]])
    tongue = points[row["6.2"]] + (0, -0.003, 0) + vertices * size
    ends = {"6.1": tongue[:, 2].argmax(), "6.3": tongue[:, 0].argmax(), "6.4": tongue[:, 0].argmin()}
    flat = np.abs(vertices[:, [0, 2]]).sum(axis=1) < 1e-6
    ends["6.2"] = np.flatnonzero(flat)[tongue[flat, 1].argmax()]
    found.append((Part("tongue", "tongue", tongue, triangles), {name: int(v) for name, v in ends.items()}))
    return found
