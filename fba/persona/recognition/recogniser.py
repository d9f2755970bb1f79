"""`ClassRecogniser`: what was learnt of faces in general: five components, examples with depth, the jaw."""

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
from fba.persona.points.layout import PARTS, VERTICES, part_points, part_vertices
from fba.persona.recognition.archive import Fields, pack_archive, read_archive
from fba.persona.recognition.component import Component
from fba.persona.recognition.network import Network
from fba.source import Path

KIND = "persona recogniser"
VERSION = 1
NEIGHBOURS = 8
"""Examples whose depth is averaged."""
JAW_FAPS = (4, 5, 52, 12, 13)
"""FAPs of lips by which the FAP of the jaw, which no tracker sees, is told."""
MIN_OUTPUT = 0.1
"""l1: the largest output below which an expression is unknown; outputs go from -1 to 1."""
SECOND_SHARE = 0.6
"""l2: the share of the largest output above which the second one counts, too."""
NONE = -1


@dataclass(frozen=True, eq=False)
class ClassRecogniser:
    """What recognises expressions, and knows what a picture does not show.

    components: by part. classes: names of what the examples are. example_classes: int (N,). example_labels:
    part -> bool (N, C), of which of the component's classes each example is one. scores: part -> float64
    (N, D), principal components of the examples. vertices: part -> float64 (2K, 2V), from displacements
    relative to a part's anchor to those of its vertices on the mask, all x and then all y. depth: (N, 86),
    millimetres that vertices move forward. jaw: (5,), FAP 3 for each of `JAW_FAPS`. seed: of the examples.
    about: how it was trained.
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
        """Return the one that comes with fba, trained with faces that are made up (docs/persona.md)."""
        return _default()

    @staticmethod
    def load(path: Path, limits: Limits = DEFAULT_LIMITS) -> ClassRecogniser:
        """Return one from a file. Raises FormatError, UnsupportedError for another version, LimitError."""
        header, arrays = read_archive(path, KIND, VERSION, limits)
        return _unpack(Fields(path, header, arrays), path)

    def save(self, path: Path) -> None:
        """Write it to a file, atomically."""
        with atomic(path) as file:
            file.write(_pack(self))

    def find_depth(self, scores: Float64, classes: Intp) -> Float64:
        """Return how far vertices move forward, (T, 86): as in the nearest examples of the same class of
        the mouth.

        The source takes the nearest one, and finds that masks tremble as it changes from frame to frame;
        this is the mean of `NEIGHBOURS`.

        scores: (T, 11), of mouths. classes: int (T,), of the mouth component; -1 for the nearest ones of
        all.
        """
        deep = np.zeros((len(scores), VERTICES))
        labels = self.example_labels["mouth"]
        for number in np.unique(classes).tolist():
            rows = np.flatnonzero(classes == number)
            known = np.flatnonzero(labels[:, number] if number >= 0 else labels.any(axis=1))
            if not len(known):
                continue
            own = self.scores["mouth"][known]
            square = (own**2).sum(axis=1) - 2 * scores[rows] @ own.T
            near = np.argpartition(square, min(NEIGHBOURS, len(known)) - 1, axis=1)[:, :NEIGHBOURS]
            deep[rows] = self.depth[known[near]].mean(axis=1)
        return deep

    def example_motion(self, part: str) -> Float64:
        """Return how far the examples' vertices of a part have moved, (N, 2V), as far as kept components
        tell."""
        component = self.components[part]
        moved = (self.scores[part] @ component.axes) * component.spread + component.mean
        return np.asarray(moved @ self.vertices[part])


@cache
def _default() -> ClassRecogniser:
    with as_file(files(__package__) / "default.recogniser") as path:
        return ClassRecogniser.load(path)


def _pack(one: ClassRecogniser) -> bytes:
    arrays: dict[str, Array] = {
        "depth": one.depth.astype(np.float16), "jaw": one.jaw.astype(np.float32),
        "example_classes": one.example_classes.astype(np.uint8),
    }  # fmt: skip
    header: dict[str, Any] = {"about": one.about, "classes": list(one.classes)}
    for part, component in one.components.items():
        net = component.network
        named = {
            "mean": component.mean, "spread": component.spread, "axes": component.axes,
            "variance": component.variance,
            "hidden": net.hidden, "hidden_shift": net.hidden_shift,
            "output": net.output, "output_shift": net.output_shift,
        }  # fmt: skip
        arrays |= {f"{part}.{name}": array.astype(np.float32) for name, array in named.items()}
        arrays[f"{part}.vertices"] = one.vertices[part].astype(np.float32)
        arrays[f"{part}.scores"] = one.scores[part].astype(np.float16)
        arrays[f"{part}.labels"] = one.example_labels[part].astype(np.uint8)
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
        """Return a name for each frame: "" for unknown, "LFAU_12", or "LFAU_26/LFAU_12", the principal
        first."""
        return [
            "" if one == NONE else classes[one] if other == NONE else f"{classes[one]}/{classes[other]}"
            for one, other in zip(self.first.tolist(), self.second.tolist(), strict=True)
        ]


def decide(outputs: Float64, *, least: float = MIN_OUTPUT, second: float = SECOND_SHARE) -> Labels:
    """Return the classes that outputs (T, C) say."""
    order = np.argsort(outputs, axis=1)
    rows = np.arange(len(outputs))
    one = order[:, -1]
    largest = outputs[rows, one]
    other = order[:, -2] if outputs.shape[1] > 1 else np.full(len(outputs), NONE)
    known = largest >= least
    both = known & (outputs[rows, other] > second * largest)
    return Labels(np.where(known, one, NONE), np.where(both, other, NONE))
