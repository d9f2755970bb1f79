"""Checks that what closes on a figure is closed, and that what is inside stays inside, over real streams.

python -m tools.figure_checks [--figure NAME] [--only mouth|lids|inside|hands]... [--frames 2000] [FILE...]

mouth: pictures of the person, 360, 720 and 1080 lines high, show neither background nor the inside of the
mouth between lips that a stream closes. lids: closed lids meet within 0.2 mm. inside: tongue, teeth and
walls of the mouth pass through no skin, over all FAPs in steps, lips closed and open, and over frames of the
streams. hands: are shown outside the thighs. Without files, the samples and the shared recordings
(FBA_SHARED, else ../shared beside the checkout) are taken. It prints each finding, and ends with 1 where
there is one.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain, product
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

import fba
from fba import figures
from fba.animation import Animation
from fba.arrays import Bool, Float32, Float64, Intp
from fba.body import BodyModel
from fba.compiled import compiled
from fba.face import Deformer, FaceModel, resolve
from fba.face.authoring.surface.landmarks import Landmarks, find_landmarks, weld_skin
from fba.face.macros import open_mouth
from fba.parameters import BAP_COUNT, FAP_COUNT, faps, point_rows
from fba.player import Offscreen, Scene
from fba.tracks import BodyTrack, FaceTrack
from fba_player._figure.face import FaceFigure, build_figure
from fba_player._figure.posing import FigurePoser
from fba_player.playback._timeline import Timeline
from fba_player.view.switches import Switches

SAMPLES = Path(fba.__file__).parent / "samples"
SHARED = Path(os.environ.get("FBA_SHARED") or Path(__file__).parents[2] / "shared")
RECORDINGS = ("vectors/real/*.fba", "data/xface/*.fap", "data/vreng/*.?ap", "data/ist/*", "data/greta/*.bvh")
LINES = (360, 720, 1080)
VIEWS = ((0.0, 0.0), (25.0, 0.0), (-35.0, 15.0), (60.0, 0.0))
"""Yaw and pitch of the camera, degrees."""
FRONTAL = 30.0
"""Up to this yaw, degrees, all that is behind the lips is face."""
BRIGHT = 3000.0
"""Colour that outshines all."""
LIP_PAIRS = (("2.2", "2.3"), ("2.6", "2.8"), ("2.7", "2.9"))
CLOSED = 2e-5
"""Gap of upper and lower lip, more than at rest, up to which lips are closed, metres."""
HEAD = slice(47, 50)
"""Columns of the FAPs that turn the head."""
TRIED = 60
"""Frames of a stream among which one with closed lips is sought."""
LIDS_MEET = 2e-4
STEPS = 9
"""Values tried of each FAP."""
REACH = {2: 400, 3: 10**6, 4: 1080, 5: 400, 6: 1080, 7: 10**6, 8: 400, 9: 1080, 10: 1080}
"""Largest value tried of a FAP, by group: as far as faces go."""
HAND_DEPTH, THIGH_REACH = 0.001, 0.1
"""Depth in a thigh that counts, and the distance from its skin within which it is known, metres."""

HAND_FRAMES = 200
"""Frames of a body that are looked at, at most."""
Named = list[tuple[str, Float32]]
"""Resolved FAPs (68,), each with a name."""


@dataclass(frozen=True)
class Checked:
    """A face that is checked. model: of a whole person; body: the same person's."""

    model: FaceModel
    body: BodyModel

    @cached_property
    def marks(self) -> Landmarks:
        """Contours of its skin."""
        return find_landmarks(
            weld_skin(self.model.parts, self.model.bound), self.model.points, self.model.bound
        )

    @cached_property
    def figure(self) -> FaceFigure:
        """The face as it is shown."""
        return build_figure(self.model)

    def of_model(self, chosen: Bool) -> Bool:
        """Return a mask of the model's vertices for one of the surface's."""
        result = np.zeros(len(self.model.vertices), dtype=bool)
        result[self.marks.surface.pool] = chosen[self.marks.surface.number]
        return result

    def walls(self) -> Bool:
        """Return (V,): the inside of the mouth, without what is within two edges of the lips."""
        inside, edges = self.marks.inside_mouth.copy(), self.marks.surface.edges
        for _ in range(2):
            beside = np.zeros_like(inside)
            for a, b in (edges.T, edges[:, ::-1].T):
                np.logical_or.at(beside, a, ~inside[b])
            inside &= ~beside
        return self.of_model(inside)

    def mouth(self) -> Bool:
        """Return (V,): walls of the mouth, teeth and tongue."""
        chosen = self.walls()
        for part in self.model.parts:
            if part.kind in ("teeth", "tongue"):
                start = self.model.starts[part.name]
                chosen[start : start + len(part.vertices)] = True
        return chosen

    def outer_skin(self) -> Intp:
        """Return triangles (F, 3) of the face around the mouth, without lips and what is behind them."""
        marks, model = self.marks, self.model
        red = marks.lips | marks.on_inner_lips | marks.inside_mouth
        red |= marks.on_contours("upper outer lip", "lower outer lip")
        triangles = model.part("skin").triangles.astype(np.intp) + model.starts["skin"]
        low, high = model.points[point_rows()["2.1"]][1] - 0.01, model.points[point_rows()["9.3"]][1]
        x, y, z = model.vertices[triangles].mean(axis=1).T
        near = (y > low) & (y < high) & (z > -0.05) & (np.abs(x) < 0.06)
        return np.asarray(triangles[near & ~self.of_model(red)[triangles].any(axis=1)])

    def inner_edges(self) -> Intp:
        """Return (E, 2): edges of tongue, teeth and walls of the mouth, by vertices of the model."""
        skin = self.model.part("skin").triangles.astype(np.intp) + self.model.starts["skin"]
        corners = np.sort(skin[self.walls()[skin].all(axis=1)][:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        found = [np.unique(corners, axis=0)]
        for part in self.model.parts:
            if part.kind in ("tongue", "teeth"):
                corners = np.sort(part.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
                found.append(np.unique(corners, axis=0).astype(np.intp) + self.model.starts[part.name])
        return np.concatenate(found)

    def person(self, frames: int = 1, bright: Bool | None = None) -> Scene:
        """Return the person at rest. bright: (V,) vertices of the face whose colour outshines all."""
        still = BodyTrack(np.zeros((frames, BAP_COUNT), np.int32), np.zeros((frames, BAP_COUNT), bool))
        face = FaceTrack(np.zeros((frames, FAP_COUNT), np.int32), np.zeros((frames, FAP_COUNT), bool))
        scene = Scene(Animation(25, np.arange(frames), face, still), self.model, body=self.body)
        shapes = scene.person.face_shapes
        for name, shape in list(shapes.items()) if bright is not None else ():
            assert bright is not None
            if (rows := bright[scene.figure.rows(name)]).any():
                colours = shape.colours.copy()
                colours[rows, :3] = BRIGHT
                shapes[name] = replace(shape, colours=colours)
        return scene

    def lid_gap(self, values: Float32) -> float:
        """Return the largest distance, metres, of a place on one lid's edge from the other lid's."""
        marks, moved = self.marks, Deformer(self.model).local(values)
        places = np.empty((len(marks.surface), 3))
        places[marks.surface.number] = moved[marks.surface.pool]
        gap = 0.0
        for side in ("left", "right"):
            top, bottom = (_sampled(places[marks.contour(f"{side} {lid} lid")]) for lid in ("upper", "lower"))
            gap = max(gap, *(float(cKDTree(a).query(b)[0].max()) for a, b in ((top, bottom), (bottom, top))))
        return gap

    def closed_frame(self, frames: Float32) -> Float32 | None:
        """Return that of frames (T, 68) with closed lips that is furthest from rest, the head not turned."""
        points = self.figure.deformer.feature_points(
            np.concatenate([np.zeros_like(frames[:1]), frames]), local=True
        )
        pairs = [points[:, [point_rows()[up], point_rows()[low]], 1] for up, low in LIP_PAIRS]
        gaps = np.stack([pair[:, 0] - pair[:, 1] for pair in pairs], axis=1)
        closed = np.flatnonzero(((gaps[1:] - gaps[0]) < CLOSED).all(axis=1))
        if not len(closed):
            return None
        lips = [fap.number - 1 for fap in faps()[2:] if fap.group in (2, 8)]
        found = frames[closed[np.abs(frames[closed][:, lips]).sum(axis=1).argmax()]].copy()
        found[HEAD] = 0.0  # the camera goes around the face
        return found

    def mouth_line(self, scene: Scene, values: Float32, clip: Float64, size: tuple[int, int]) -> Bool:
        """Return a mask (H, W) of a picture's pixels on the line between closed lips. clip: the camera's."""
        pose, surface = self.figure.pose(values), self.marks.surface
        places = np.empty((len(surface), 3))
        places[surface.number] = pose.positions[surface.pool]
        line = _sampled(places[self.marks.contour("upper inner lip")])
        _, joints = scene._pose_at(0.0)
        world = scene._face_matrix(joints) @ pose.turn
        x, y, _, w = clip @ world @ np.c_[line, np.ones(len(line))].T
        mask = np.zeros(size[::-1], dtype=bool)
        mask[((1 - y / w) / 2 * size[1]).astype(int), ((x / w + 1) / 2 * size[0]).astype(int)] = True
        return mask


def pierced(positions: Float32, edges: Intp, triangles: Intp) -> int:
    """Return how many times edges (E, 2) pass through triangles (F, 3)."""
    ends = positions[edges].astype(np.float64)
    ends = ends[ends[:, :, 1].min(axis=1).argsort()]
    lowest = ends[:, :, 1].min(axis=1)
    corners = positions[triangles].astype(np.float64)
    first = np.searchsorted(lowest, corners[:, :, 1].min(axis=1) - np.ptp(ends[:, :, 1], axis=1).max())
    last = np.searchsorted(lowest, corners[:, :, 1].max(axis=1), "right")
    return int(_count_crossings(ends, corners, first, last))


@compiled
def _count_crossings(ends: Float64, corners: Float64, first: Intp, last: Intp) -> int:
    """Return how many edges (E, 2, 3) cross triangles (F, 3, 3), by Moeller and Trumbore.

    first, last: (F,) bounds of the edges that are looked at for each, within 0..E. An edge in the plane of a
    triangle does not cross it.
    """
    count = 0
    for f in range(len(corners)):
        a, b, c = corners[f]
        low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
        one, two = b - a, c - a
        nx, ny, nz = (
            one[1] * two[2] - one[2] * two[1],
            one[2] * two[0] - one[0] * two[2],
            one[0] * two[1] - one[1] * two[0],
        )
        for e in range(first[f], last[f]):
            p, q = ends[e]
            if max(p[0], q[0]) < low[0] or min(p[0], q[0]) > high[0]:
                continue
            if max(p[2], q[2]) < low[2] or min(p[2], q[2]) > high[2]:
                continue
            wx, wy, wz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
            dx, dy, dz = p[0] - a[0], p[1] - a[1], p[2] - a[2]
            towards = -(wx * nx + wy * ny + wz * nz)
            if towards == 0.0:
                continue
            x, y, z = dy * wz - dz * wy, dz * wx - dx * wz, dx * wy - dy * wx
            u = (two[0] * x + two[1] * y + two[2] * z) / towards
            v = -(one[0] * x + one[1] * y + one[2] * z) / towards
            t = (dx * nx + dy * ny + dz * nz) / towards
            count += u >= 0.0 and v >= 0.0 and u + v <= 1.0 and 0.0 <= t <= 1.0
    return count


def _sampled(line: Float64) -> Float64:
    """Return points along a line (N, 3), 20 on each of its pieces."""
    steps = np.linspace(0, 1, 20, endpoint=False)[:, None, None]
    return np.concatenate([(line[:-1] + steps * np.diff(line, axis=0)).reshape(-1, 3), line[-1:]])


def check_mouth(checked: Checked, frames: Named) -> Iterator[str]:
    """Yield where pictures of closed lips, resolved FAPs (68,) by name, show background or the mouth."""
    plain, shining, grey = checked.person(), checked.person(bright=checked.mouth()), checked.person()
    grey.show("background", "grey")
    camera = plain.camera("body", 16 / 9)
    for lines in LINES:
        size = (lines * 16 // 9, lines)
        with Offscreen(plain, size) as one, Offscreen(shining, size) as two, Offscreen(grey, size) as three:
            for (name, values), (yaw, pitch) in product(frames, VIEWS):
                one.camera = two.camera = three.camera = replace(camera, yaw=yaw, pitch=pitch)
                picture = one.still(values)
                seen = int((picture != two.still(values)).any(axis=2).sum())
                if abs(yaw) < FRONTAL:
                    line = checked.mouth_line(plain, values, one.camera.clip_matrix(size), size)
                    seen += int((picture[line] != three.still(values)[line]).any(axis=1).sum())
                if seen:
                    yield f"{name} at {lines} lines, yaw {yaw:g}: {seen} pixels behind closed lips"


def check_lids(checked: Checked) -> Iterator[str]:
    """Yield how closed lids fail to meet."""
    for upper in range(512, 1025, 128):
        values = np.zeros(FAP_COUNT, np.float32)
        values[18:20], values[20:22] = upper, 1024 - upper
        if (gap := checked.lid_gap(values)) >= LIDS_MEET:
            yield f"upper lids {upper}, lower {1024 - upper}: {gap * 1000:.2f} mm apart"


def fap_steps() -> Iterator[tuple[str, Float32]]:
    """Yield each low-level FAP in steps within its range, lips closed and open, with its name."""
    for fap in faps()[2:]:
        low, high = np.clip(fap.i_limits, -REACH[fap.group], REACH[fap.group])
        for opened, value in product((False, True), np.unique(np.linspace(low, high, STEPS).astype(int))):
            values = open_mouth(100 * opened)
            values[fap.number - 1] = value
            yield f"{fap.name}={value}{' with the mouth open' if opened else ''}", values


def check_inside(checked: Checked, poses: Iterable[tuple[str, Float32]]) -> Iterator[str]:
    """Yield poses, named resolved FAPs (68,), at which tongue or teeth pass through the skin."""
    edges, skin = checked.inner_edges(), checked.outer_skin()
    for name, values in poses:
        if count := pierced(checked.figure.pose(values).positions, edges, skin):
            yield f"{name}: {count} edges of tongue, teeth and walls of the mouth pass through the skin"


def hand_depths(body: BodyModel, joints: Float64) -> tuple[float, int]:
    """Return how deep hands are in thighs, metres, and how many vertices of hands, for joints (J, 4, 4).

    The depth is that below the plane through the nearest vertex of a thigh, where the hand is below that
    through the nearest of trunk and legs as well: a thigh has no skin where it meets the trunk.
    """
    names, owner = body.skeleton.names, body.joints[np.arange(len(body.joints)), body.weights.argmax(axis=1)]
    positions, normals = np.empty_like(body.vertices), np.empty_like(body.vertices)
    body.skin(joints, positions, normals)
    wrists, arms = (
        np.concatenate([body.skeleton.descendants(names.index(f"{side}_{joint}")) for side in "lr"])
        for joint in ("wrist", "shoulder")
    )
    hands = positions[np.isin(owner, wrists)]
    thighs = np.isin(owner, [names.index("l_hip"), names.index("r_hip")])
    away, _ = cKDTree(positions[thighs]).query(hands, distance_upper_bound=THIGH_REACH)
    near = hands[np.isfinite(away)]

    def below(among: Bool) -> Float64:
        _, at = cKDTree(positions[among]).query(near)
        return -((near - positions[among][at]) * normals[among][at]).sum(axis=1)

    depth = np.where(below(~np.isin(owner, arms)) > 0, below(thighs), 0.0)
    return float(depth.max(initial=0.0)), int((depth > HAND_DEPTH).sum())


def check_hands(body: BodyModel, animations: dict[str, Animation]) -> Iterator[str]:
    """Yield the animations whose hands are shown in the thighs, with the worst frame."""
    poser, switches = FigurePoser(body, "iso"), Switches()
    for name, animation in animations.items():
        frames = np.unique(np.linspace(0, len(animation) - 1, HAND_FRAMES).astype(int))
        _, baps = Timeline(animation).many([float(animation.index[k] / animation.rate) for k in frames])
        depths, counts = np.array([hand_depths(body, poser.pose(row, switches)) for row in baps]).T
        if counts.any():
            worst = frames[depths.argmax()]
            yield f"{name}: hands in thighs in {(counts > 0).sum()} of {len(frames)} frames, by up to " + (
                f"{depths.max() * 1000:.0f} mm in frame {worst}"
            )


def choose_frames(checked: Checked, faces: dict[str, Float32], count: int) -> tuple[Named, Named]:
    """Return a closed frame of each stream that has one, and frames of all of them, the same each time."""
    random, closed, pool = np.random.default_rng(30), Named(), Named()
    for name, frames in faces.items():
        tried = frames[np.sort(random.choice(len(frames), min(TRIED, len(frames)), replace=False))]
        if (found := checked.closed_frame(tried)) is not None:
            closed.append((name, found))
        pool += [(f"{name} frame {number}", frame) for number, frame in enumerate(frames)]
    chosen = np.sort(random.choice(len(pool), min(count, len(pool)), replace=False))
    return closed, [pool[number] for number in chosen]


def main(arguments: list[str] | None = None) -> int:
    """Run the checks that the command line asks for; return 1 if one failed."""
    parser = argparse.ArgumentParser(
        prog="python -m tools.figure_checks",
        description=__doc__,
        formatter_class=argparse.RawTextHelpFormatter,
    )
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--figure", default="alex", choices=list(figures.FIGURES))
    parser.add_argument("--only", action="append", choices=["mouth", "lids", "inside", "hands"])
    parser.add_argument("--frames", type=int, default=2000, help="frames of streams for the check `inside`")
    given = parser.parse_args(arguments)
    files = given.files or [
        SAMPLES / "hello.fap",
        SAMPLES / "hello.bvh",
        *(path for pattern in RECORDINGS for path in sorted(SHARED.glob(pattern))),
    ]
    streams = {path.name: fba.read(path) for path in files}
    checked = Checked(figures.face(given.figure), figures.body(given.figure))
    faces = {
        name: resolve(one.face, checked.model).astype(np.float32)
        for name, one in streams.items()
        if one.face is not None
    }
    closed, frames = choose_frames(checked, faces, given.frames)
    bodies = {name: one for name, one in streams.items() if one.body is not None}
    checks = {
        "mouth": (f"{len(closed)} streams", check_mouth(checked, closed)),
        "lids": ("closed in 5 ways", check_lids(checked)),
        "inside": (f"all FAPs and {len(frames)} frames", check_inside(checked, chain(fap_steps(), frames))),
        "hands": (f"{len(bodies)} bodies", check_hands(checked.body, bodies)),
    }
    failed = False
    for name, (what, findings) in checks.items():
        if not given.only or name in given.only:
            found = 0
            for finding in findings:
                print(f"  {finding}", flush=True)
                found += 1
            print(f"{name} ({what}): {f'{found} findings' if found else 'nothing found'}", flush=True)
            failed |= found > 0
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
