"""The lower jaw and the tongue.

FAP 3 open_jaw turns the jaw about a hinge at the ears, FAPs 14 and 15 slide it; FAPs 43-47 move the tongue.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64, Intp
from fba.face.authoring.surface._fold_limits import Limiter
from fba.face.authoring.surface._motion import Motion, fap_limits
from fba.face.authoring.surface._motion_limits import human_range, linear_motion, stop_at_folds
from fba.face.authoring.surface._weights import reachable_region, solve_smooth_field, trim_small
from fba.face.authoring.surface.landmarks import LIP_CONTOURS, Landmarks
from fba.face.authoring.surface.surface import weld_parts
from fba.face.model import Part
from fba.face.points import OPEN_JAW, TONGUE_ROLL
from fba.sampling import smoothstep

CHIN = ("2.1", "2.10", "2.11", "2.12")
EARS = ("10.7", "10.8", "10.9", "10.10")
"""Where the ears meet the face; the hinge lies between them."""
UNMOVED_POINTS = (*EARS, "3.9", "3.10", "5.3", "5.4", "8.1", "9.1", "9.2", "9.3", "9.15", "10.5", "10.6")
"""Feature points that the jaw does not move."""
TONGUE_FAPS = (43, 44, 45, 46, 47)
TONGUE_POINTS = {43: ("6.1",), 44: ("6.1",), 45: ("6.1",), 46: ("6.2",), 47: ("6.2", "6.3", "6.4")}


@dataclass(frozen=True)
class Tuning:
    """Constants of the jaw."""

    reach: float = 1.5  # reach of the jaw's motion into cheeks and neck, in ES0
    neck_distance: float = 0.1  # ES0 below the chin, beyond which open edges are where the neck was cut
    corner_share: float = 0.6  # share of the jaw's rotation that the skin over its corners makes
    max_opening: float = np.radians(30.0)  # radians by which the jaw opens at most
    # motion of the hinge forwards and down per radian, in ES0: some 11 mm when wide open
    hinge_slide: tuple[float, float] = (0.35, 0.1)
    max_interval: float = np.radians(3.0)  # longest interval into which the arc is cut, radians
    # share of a sliding jaw's motion that the lower lip makes. An opening jaw does not move the lip, which
    # has FAPs of its own.
    lip_ride: float = 0.5
    # where the cheek hollows between the jaws: shares of feature points of each side, its breadth in ES0, and
    # its depth as a share of the way of the chin
    hollow: tuple[float, float, float] = (0.7, 0.26, 0.16)
    slack: float = 0.2  # distance in ES0 beyond which the skin does not overshoot
    min_share: float = 0.004  # shares of a motion below this are set to 0
    teeth_margin: float = 0.12  # height about the teeth's edge where the jaw's share goes from 0 to 1, MNS0
    # height above and below the teeth's edge over which the inside of the mouth may stretch, in MNS0
    cheek_margin: float = 0.4
    one_jaw_margin: float = 0.15  # teeth with half plus this share on one side of their edge are one jaw's
    lip_depth: float = 0.16  # distance from the lips beyond which the mouth moves as the jaws do, in ES0
    root: float = 0.15  # share of the tongue's length that stays in the throat
    tip_bend: float = 2.0  # power of the length with which the motion falls off to the root: it bends
    roll_steps: int = 8  # number of values at which the roll is computed


TUNING = Tuning()


@dataclass(frozen=True, eq=False)
class Jaw:
    """The jaw of a face.

    share: (N,) share of the opening at each vertex of the surface, 1 on the chin. sliding: the same for FAPs
    14 and 15, with the lower lip. hinge: (y, z) of the axis, metres. chin: (3,), the point that sinks by
    exactly value x MNS. size: ES0 in metres.
    """

    share: Float64
    sliding: Float64
    hinge: Float64
    chin: Float64
    size: float


def find_jaw(marks: Landmarks) -> Jaw | str:
    """Return the jaw of a face, or the reason why it has none."""
    if reason := marks.missing_point(OPEN_JAW):
        return reason
    ears = np.array([marks.point_or_average(name) for name in EARS])
    hinge = ears.mean(axis=0)[1:]
    chin = marks.point("2.1")
    if chin[2] - hinge[1] <= 0 or chin[1] >= hinge[0]:
        return "the chin (2.1) is not below and before the ears"
    share = _share(marks, hinge)
    return Jaw(share, _with_lip(marks, share), hinge, chin, marks.fapu.ES * 1024)


def opening_angles(jaw: Jaw, unit: float) -> tuple[Float64, Float64]:
    """Return (values, angles): rising values of FAP 3 and the angles at which the chin has sunk that far."""
    low, high = fap_limits(OPEN_JAW)
    fine = np.linspace(0, TUNING.max_opening, 400)
    sunk = -opening_shifts(jaw.chin[None], jaw, fine)[:, 0, 1]
    fine = fine[: int(sunk.argmax()) + 1]
    sunk = np.maximum.accumulate(sunk[: len(fine)])
    deepest = min(float(sunk[-1]) / unit, high)
    count = max(5, int(np.ceil(fine[-1] / TUNING.max_interval)))
    values = np.unique(np.round(np.linspace(0, deepest, count + 1)))
    angles = np.interp(values * unit, sunk, fine)
    if values[-1] < high:
        values, angles = np.append(values, high), np.append(angles, angles[-1])
    # a closed jaw does not close further
    return np.append([min(low, -1.0)], values), np.append([0.0], angles)


def opening_shifts(points: Float64, jaw: Jaw, angles: Float64) -> Float64:
    """Return (K, N, 3) shifts of points (N, 3), metres, when the jaw opens by angles (K,), radians.

    The jaw turns about the hinge, +z down, while the hinge itself slides forwards and a little down, as the
    joint of a human jaw does.
    """
    y, z = points[:, 1] - jaw.hinge[0], points[:, 2] - jaw.hinge[1]
    cos, sin = np.cos(angles)[:, None], np.sin(angles)[:, None]
    zero = np.zeros((len(angles), len(points)))
    forward, down = (step * jaw.size * angles[:, None] for step in TUNING.hinge_slide)
    return np.stack([zero, y * cos - z * sin - y - down, y * sin + z * cos - z + forward], axis=-1)


def hollowing(marks: Landmarks) -> Float64:
    """Return (N, 3) how far the skin of the cheeks goes in for each metre by which the chin sinks."""
    surface = marks.surface
    front, breadth, depth = TUNING.hollow
    result = np.zeros((len(surface), 3))
    for names in (("5.1", "2.13"), ("5.2", "2.14")):
        if marks.has(*names):
            centre = front * marks.point(names[0]) + (1 - front) * marks.point(names[1])
            away = np.linalg.norm(surface.vertices - centre, axis=1) / (breadth * marks.fapu.ES * 1024)
            weight = trim_small(np.exp(-(away**2)), TUNING.min_share) * ~(marks.inside_mouth | marks.lips)
            result -= depth * weight[:, None] * surface.normals
    return result


def bite_height(marks: Landmarks) -> float:
    """Return the height (y, metres) at which upper and lower teeth meet."""
    known: list[float] = []
    for pair in (("9.10", "9.11"), ("2.2", "2.3")):
        known = known or [height for name in pair if np.isfinite(height := marks.point(name)[1])]
    return float(np.mean(known or [marks.point_or_average("9.10")[1]]))


def below_bite(marks: Landmarks, points: Float64, hinge: Float64) -> Float64:
    """Return (N,) metres below the plane through the hinge and the teeth's edge."""
    front = marks.point_or_average("9.10")
    reach = max(front[2] - hinge[1], 1e-6)
    ahead = np.clip((points[:, 2] - hinge[1]) / reach, 0.2, None)
    plane = hinge[0] + (bite_height(marks) - hinge[0]) * ahead
    return np.asarray(plane - points[:, 1])


def jaw_share_of_part(marks: Landmarks, part: Part, hinge: Float64) -> Float64:
    """Return (V,) share of the jaw's turn at each vertex of a part inside the mouth.

    A connected piece on one side of the teeth's edge moves as one, as teeth do not bend.
    """
    if part.kind == "tongue":
        return np.ones(len(part.vertices))
    shape = weld_parts([part])
    margin = TUNING.teeth_margin * marks.fapu.MNS * 1024
    each = smoothstep(below_bite(marks, shape.vertices, hinge) / (2 * margin) + 0.5)
    if part.kind == "teeth":
        row = _by_teeth_points(marks, part)
        if row is not None:
            return np.full(len(part.vertices), row)
        # decided for the whole row first, then for each piece: an overbite must not move upper teeth
        if abs(float(each.mean()) - 0.5) > TUNING.one_jaw_margin:
            return np.full(len(part.vertices), float(each.mean() > 0.5))
        count = np.bincount(shape.component)
        mean = np.bincount(shape.component, each) / count
        in_one_jaw = np.abs(mean - 0.5) > TUNING.one_jaw_margin
        each = np.where(in_one_jaw[shape.component], (mean > 0.5)[shape.component], each)
    return each[shape.number]


ROWS = {0.0: "upper", 1.0: "lower"}
"""Beginnings of the names of rows of teeth, by their share of the jaw's turn."""


def _by_teeth_points(marks: Landmarks, part: Part) -> float | None:
    """Return 1 for the lower teeth, 0 for the upper, if the feature points of only one row are on a part."""
    close: dict[float, bool] = {}
    for row, names in ((0.0, ("9.8", "9.10")), (1.0, ("9.9", "9.11"))):
        known = [point for name in names if np.isfinite(point := marks.point(name)).all()]
        if not known:
            # with points of one row only, a part could still be both rows, unless its name says one
            if not part.name.startswith(ROWS[1.0 - row]):
                return None
            close[row] = False
            continue
        away = [float(np.linalg.norm(part.vertices - point, axis=1).min()) for point in known]
        close[row] = max(away) < 0.05 * marks.fapu.MNS * 1024
    if close[0.0] == close[1.0]:
        return None
    return 1.0 if close[1.0] else 0.0


def _share(marks: Landmarks, hinge: Float64) -> Float64:
    """Return (N,) share of the opening at each vertex of the surface."""
    surface, es = marks.surface, marks.fapu.ES * 1024
    line = marks.contour("jaw line")
    values: dict[int, float] = {}
    if len(line):
        values |= dict(zip(line.tolist(), _along_jaw(marks, line).tolist(), strict=True))
    values |= dict.fromkeys(marks.vertices_of(("2.13", "2.14")).tolist(), TUNING.corner_share)
    values |= dict.fromkeys(marks.vertices_of(CHIN).tolist(), 1.0)
    source = np.array(sorted(values))
    lips = marks.on_contours(*LIP_CONTOURS) | marks.lips
    # the neck's lower end joins a body that does not move
    end = surface.open_edge & (surface.vertices[:, 1] < marks.point("2.1")[1] - TUNING.neck_distance * es)
    still = np.union1d(np.flatnonzero(lips | end), marks.vertices_of(UNMOVED_POINTS))
    inside = marks.inside_mouth
    near, far = surface.distances(source, TUNING.reach * es), surface.distances(still, 3 * TUNING.reach * es)
    free = reachable_region(near, far, TUNING.reach * es) & ~inside & ~lips
    fixed = np.concatenate([source, np.flatnonzero(lips)])
    given = np.concatenate([[values[int(vertex)] for vertex in source], np.zeros(int(lips.sum()))])
    if inside.any():
        depth = surface.distances(np.flatnonzero(lips | marks.on_inner_lips))
        below = below_bite(marks, surface.vertices, hinge)
        clear = np.abs(below) > TUNING.cheek_margin * marks.fapu.MNS * 1024
        jaws = np.flatnonzero(inside & (depth > TUNING.lip_depth * es) & clear)
        fixed = np.concatenate([fixed, jaws])
        given = np.concatenate([given, (below[jaws] > 0).astype(np.float64)])
        free |= inside
    order = np.unique(fixed, return_index=True)[1]
    field = solve_smooth_field(surface, free, fixed[order], given[order][:, None], slack=TUNING.slack * es)
    return trim_small(np.clip(field[:, 0], 0.0, 1.0), TUNING.min_share)


def _along_jaw(marks: Landmarks, line: Intp) -> Float64:
    """Return (M,) shares along the jaw line: 1 between the corners of the chin, less towards the jaw's."""
    chin = np.flatnonzero(np.isin(line, marks.vertices_of(CHIN)))
    steps = np.linalg.norm(np.diff(marks.surface.vertices[line], axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(steps)])
    first, last = length[chin[0]], length[chin[-1]]
    left = np.where(length < first, (first - length) / max(first, 1e-9), 0.0)
    right = np.where(length > last, (length - last) / max(length[-1] - last, 1e-9), 0.0)
    return 1 - (1 - TUNING.corner_share) * smoothstep(np.maximum(left, right))


def _with_lip(marks: Landmarks, share: Float64) -> Float64:
    """Return (N,) shares of a sliding jaw's motion: half on the lower lip, none on the upper one."""
    upper = marks.on_contours("upper outer lip", "upper inner lip")
    lower = marks.on_contours("lower outer lip", "lower inner lip") & ~upper
    if not lower.any():
        return share
    # interpolated over lips and skin between chin, lower lip and upper lip
    es = marks.fapu.ES * 1024
    surface = marks.surface
    close = surface.distances(np.flatnonzero(lower), 0.6 * es) < 0.5 * es
    along = _from_corners(marks, np.flatnonzero(lower))
    fixed = np.flatnonzero(lower | upper | ~close | (share > 0.9))
    given = share.copy()
    given[upper] = 0.0
    given[lower] = TUNING.lip_ride * along
    field = solve_smooth_field(surface, close, fixed, given[fixed][:, None], slack=TUNING.slack * es)[:, 0]
    return trim_small(np.clip(field, 0.0, 1.0), TUNING.min_share)


def _from_corners(marks: Landmarks, vertices: Intp) -> Float64:
    """Return (M,) 0 about the corners of the mouth, where the lips touch, 1 in its middle."""
    x = marks.surface.vertices[vertices, 0]
    left, right = marks.point_or_average("2.4")[0], marks.point_or_average("2.5")[0]
    across = (x - right) / (left - right)
    return smoothstep(3.5 * np.minimum(across, 1 - across) - 0.5)


def tongue_motion(marks: Landmarks, part: Part, fap: int) -> Motion | str:
    """Return the motion of the tongue's part for a FAP, or the reason why it cannot be made."""
    missing = [name for name in TONGUE_POINTS[fap] if np.isnan(marks.point(name)).any()]
    if missing:
        return f"feature point {missing[0]} is unknown"
    points = part.vertices.astype(np.float64)
    limiter = Limiter.from_mesh(points, part.triangles.astype(np.intp))
    if fap == TONGUE_ROLL:
        return stop_at_folds(limiter, _tongue_roll(marks, points))
    tip = marks.point("6.1")
    root = float(points[:, 2].min())
    if tip[2] - root <= 0:
        return "the tongue's tip (6.1) is not before its root"
    root += TUNING.root * float(tip[2] - root)
    length = np.clip((points[:, 2] - root) / (tip[2] - root), 0.0, 1.0)
    if fap == 46:
        middle = (marks.point("6.2")[2] - root) / (tip[2] - root)
        if not 0 < middle < 1:
            return "the tongue's body (6.2) is not between its root and its tip"
        share = np.where(
            length < middle, smoothstep(length / middle), smoothstep((1 - length) / (1 - middle))
        )
    elif fap == 45:
        share = length
    else:
        share = length**TUNING.tip_bend
    field = share[:, None] * marks.step(fap)
    return linear_motion(limiter, np.arange(len(points)), field, *fap_limits(fap), human_range(fap))


def _tongue_roll(marks: Landmarks, points: Float64) -> Motion:
    """Return the motion that turns the sides up about the middle line, more further out: a U in section."""
    middle, left, right = (marks.point(name) for name in ("6.2", "6.3", "6.4"))
    unit = marks.fapu.AU
    low, high = fap_limits(TONGUE_ROLL)
    steps = np.append(np.linspace(low, 0.0, 3), np.linspace(0.0, high, TUNING.roll_steps + 1))
    values: Float64 = np.unique(np.round(steps)).astype(np.float64)
    half = (left[0] - right[0]) / 2
    x, y = points[:, 0] - middle[0], points[:, 1] - middle[1]
    root, tip = float(points[:, 2].min()), float(points[:, 2].max())
    root += TUNING.root * (tip - root)
    along = (
        smoothstep((points[:, 2] - root) / max(left[2] - root, 1e-9)) if tip > root else np.ones(len(points))
    )
    shifts = np.zeros((len(values), len(points), 3))
    for k, value in enumerate(values):
        turn = value * unit * np.clip(x / half, -1.2, 1.2) * along
        shifts[k, :, 0] = x * np.cos(turn) - y * np.sin(turn) - x
        shifts[k, :, 1] = x * np.sin(turn) + y * np.cos(turn) - y
    return Motion(values, np.arange(len(points)), shifts)
