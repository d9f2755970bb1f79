"""`ClassRecogniser`: knowledge of faces in general: five components, examples with their depth, the jaw.

A `Component` recognises the classes of a part, by principal components and a small network.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.resources import as_file, files
from typing import Any

import numpy as np

from fba.arrays import Array, Bool, Float64, Intp
from fba.atomic import atomic
from fba.errors import FormatError
from fba.limits import DEFAULT_LIMITS, Limits
from fba.persona.points.layout import ANCHORS, PARTS, VERTICES, part_points, part_vertices
from fba.persona.recognition._archive import Fields, pack_archive, read_archive
from fba.source import Path


@dataclass(frozen=True, eq=False)
class Network:
    """A network with one hidden layer of tanh units and a linear output for each class.

    outputs = tanh(inputs . hidden + hidden_shift) . output + output_shift. hidden: float64 (D, H);
    hidden_shift: (H,); output: (H, C); output_shift: (C,).
    """

    hidden: Float64
    hidden_shift: Float64
    output: Float64
    output_shift: Float64

    def __call__(self, inputs: Float64) -> Float64:
        """Return outputs (..., C), about -1 to 1, for inputs (..., D)."""
        return np.asarray(np.tanh(inputs @ self.hidden + self.hidden_shift) @ self.output + self.output_shift)


@dataclass(frozen=True, eq=False)
class Component:
    """A part of the face.

    mean, spread: float64 (2K,), of the training displacements. axes: (D, 2K), principal components of the
    standardised displacements. variance: (2K,), share of the variance of every principal component, also of
    those left out. network: its outputs are `classes`. share: of the validation examples it gets right.
    """

    part: str
    classes: tuple[str, ...]
    mean: Float64
    spread: Float64
    axes: Float64
    variance: Float64
    network: Network
    share: float

    def scores(self, moved: Float64) -> Float64:
        """Return principal components (..., D) of displacements (..., 2K)."""
        return np.asarray(((moved - self.mean) / self.spread) @ self.axes.T)

    def outputs(self, moved: Float64) -> Float64:
        """Return the outputs (T, C) of the network for displacements (T, 2K)."""
        return self.network(self.scores(moved))

    @property
    def kept_variance(self) -> float:
        """Share of the variance that `axes` cover."""
        return float(self.variance[: len(self.axes)].sum())


def displacements(points: Float64, neutral: Float64, part: str) -> Float64:
    """Return how far the points of a part are from the neutral face: float64 (T, 2K), all x, then all y.

    points: (T, 64, 2) on the standard mask. neutral: (64, 2), or (T, 64, 2). Both are taken relative to the
    part's anchor. Equation 4.3 of the source.
    """
    rows, anchor = part_points(part), ANCHORS[part] - 1
    moved, still = (face[..., rows, :2] - face[..., anchor : anchor + 1, :2] for face in (points, neutral))
    return np.concatenate([moved[..., 0] - still[..., 0], moved[..., 1] - still[..., 1]], axis=-1)


KIND = "persona recogniser"
VERSION = 1
NEIGHBOURS = 8
"""Number of examples whose depth is averaged."""
JAW_FAPS = (4, 5, 52, 12, 13)
"""FAPs of the lips from which FAP 3 is estimated: no tracker sees the jaw."""
MIN_OUTPUT = 0.1
"""l1 of the source: an expression is unknown where the largest output, -1 to 1, is smaller."""
SECOND_SHARE = 0.6
"""l2 of the source: the second class counts, too, where its output is above this share of the largest."""
NONE = -1


@dataclass(frozen=True, eq=False)
class ClassRecogniser:
    """Recognition of expressions, and the depth and the jaw, which pictures do not show.

    components: by part. classes: names of the examples' classes. example_classes: int (N,), of each example.
    example_labels: part -> bool (N, C), the component's classes that each example has. scores: part ->
    float64 (N, D), principal components of the examples. vertices: part -> float64 (2K, 2V), map from
    displacements relative to a part's anchor to those of its vertices on the mask, all x and then all y.
    depth: (N, 86), forward displacements of the vertices, millimetres. jaw: (5,), coefficients of `JAW_FAPS`
    in FAP 3. about: how it was trained.
    """

    components: dict[str, Component]
    classes: tuple[str, ...]
    example_classes: Intp
    example_labels: dict[str, Bool]
    scores: dict[str, Float64]
    depth: Float64
    jaw: Float64
    vertices: dict[str, Float64]
    about: str

    @staticmethod
    def default() -> ClassRecogniser:
        """Return the built-in recogniser, trained with synthetic faces (docs/persona.md)."""
        return _default()

    @staticmethod
    def load(path: Path, limits: Limits = DEFAULT_LIMITS) -> ClassRecogniser:
        """Return a recogniser from a file; FormatError, UnsupportedError for another version, LimitError."""
        header, arrays = read_archive(path, KIND, VERSION, limits)
        return _unpack(Fields(path, header, arrays), path)

    def save(self, path: Path) -> None:
        """Write the recogniser to a file, atomically."""
        with atomic(path) as file:
            file.write(_pack(self))

    def find_depth(self, scores: Float64, classes: Intp) -> Float64:
        """Return the forward displacements of vertices, (T, 86), from examples of the mouth's class.

        The mean of the nearest `NEIGHBOURS`: with the nearest alone, as in the source, masks tremble as it
        changes from frame to frame. scores: (T, 11), of mouths. classes: int (T,), of the mouth component; -1
        for examples of any class.
        """
        deep = np.zeros((len(scores), VERTICES))
        labels = self.example_labels["mouth"]
        for number in np.unique(classes).tolist():
            rows = np.flatnonzero(classes == number)
            examples = np.flatnonzero(labels[:, number] if number >= 0 else labels.any(axis=1))
            if not len(examples):
                continue
            there = self.scores["mouth"][examples]
            square = (there**2).sum(axis=1) - 2 * scores[rows] @ there.T
            near = np.argpartition(square, min(NEIGHBOURS, len(examples)) - 1, axis=1)[:, :NEIGHBOURS]
            deep[rows] = self.depth[examples[near]].mean(axis=1)
        return deep

    def example_motion(self, part: str) -> Float64:
        """Return the displacements of a part's vertices in the examples, (N, 2V), from their `scores`."""
        component = self.components[part]
        moved = (self.scores[part] @ component.axes) * component.spread + component.mean
        return np.asarray(moved @ self.vertices[part])


@cache
def _default() -> ClassRecogniser:
    with as_file(files(__package__) / "default.recogniser") as path:
        return ClassRecogniser.load(path)


def _pack(recogniser: ClassRecogniser) -> bytes:
    arrays: dict[str, Array] = {
        "depth": recogniser.depth.astype(np.float16), "jaw": recogniser.jaw.astype(np.float32),
        "example_classes": recogniser.example_classes.astype(np.uint8),
    }  # fmt: skip
    header: dict[str, Any] = {"about": recogniser.about, "classes": list(recogniser.classes)}
    for part, component in recogniser.components.items():
        net = component.network
        named = {
            "mean": component.mean, "spread": component.spread, "axes": component.axes,
            "variance": component.variance,
            "hidden": net.hidden, "hidden_shift": net.hidden_shift,
            "output": net.output, "output_shift": net.output_shift,
        }  # fmt: skip
        arrays |= {f"{part}.{name}": array.astype(np.float32) for name, array in named.items()}
        arrays[f"{part}.vertices"] = recogniser.vertices[part].astype(np.float32)
        arrays[f"{part}.scores"] = recogniser.scores[part].astype(np.float16)
        arrays[f"{part}.labels"] = recogniser.example_labels[part].astype(np.uint8)
        header |= {f"{part}.classes": list(component.classes), f"{part}.share": component.share}
    return pack_archive(KIND, VERSION, header, arrays)


def _unpack(fields: Fields, path: Path) -> ClassRecogniser:
    classes = fields.texts("classes")
    example_classes = fields.indices("example_classes", len(classes))
    count = len(example_classes)
    components, scores, labels, vertices = {}, {}, {}, {}
    for part in PARTS:
        width = 2 * len(part_points(part))
        names = fields.texts(f"{part}.classes")
        axes = fields.array(f"{part}.axes", None, width)
        spread = fields.array(f"{part}.spread", width)
        if not ((spread > 0).all() and len(names) and len(axes)):
            raise FormatError(
                f"{part}: spreads must be positive, and there must be classes and axes", path=path
            )
        hidden = fields.array(f"{part}.hidden", len(axes), None)
        network = Network(
            hidden, fields.array(f"{part}.hidden_shift", hidden.shape[1]),
            fields.array(f"{part}.output", hidden.shape[1], len(names)),
            fields.array(f"{part}.output_shift", len(names)),
        )  # fmt: skip
        components[part] = Component(
            part, names, fields.array(f"{part}.mean", width), spread, axes,
            fields.array(f"{part}.variance", None), network, fields.number(f"{part}.share"),
        )  # fmt: skip
        vertices[part] = fields.array(f"{part}.vertices", width, 2 * len(part_vertices(part)))
        scores[part] = fields.array(f"{part}.scores", count, len(axes))
        labels[part] = fields.array(f"{part}.labels", count, len(names)) > 0
    depth = fields.array("depth", count, VERTICES)
    jaw = fields.array("jaw", len(JAW_FAPS))
    return ClassRecogniser(
        components, classes, example_classes, labels, scores, depth, jaw, vertices, fields.text("about")
    )


@dataclass(frozen=True, eq=False)
class Labels:
    """Classes of frames, as positions in a list of them. first, second: int (T,), -1 for none."""

    first: Intp
    second: Intp

    def __len__(self) -> int:
        return len(self.first)

    def names(self, classes: tuple[str, ...]) -> list[str]:
        """Return a name for each frame: "" for unknown, "LFAU_12", or two, the principal class first."""
        named = (*classes, "")  # NONE is the last
        return [
            "/".join(filter(None, (named[first], named[second])))
            for first, second in zip(self.first.tolist(), self.second.tolist(), strict=True)
        ]


def decide(outputs: Float64, *, least: float = MIN_OUTPUT, second: float = SECOND_SHARE) -> Labels:
    """Return the classes of outputs (T, C): the largest from `least`, the next above `second` times that."""
    order = np.argsort(outputs, axis=1)
    rows = np.arange(len(outputs))
    first = order[:, -1]
    largest = outputs[rows, first]
    runner_up = order[:, -2] if outputs.shape[1] > 1 else np.full(len(outputs), NONE)
    known = largest >= least
    both = known & (outputs[rows, runner_up] > second * largest)
    return Labels(np.where(known, first, NONE), np.where(both, runner_up, NONE))
