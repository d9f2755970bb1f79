"""An HTML page about a Persona: classes and masks, motion, components, frames among the examples."""

from __future__ import annotations

import html
from collections.abc import Sequence

import numpy as np

from fba.arrays import Float64
from fba.persona._observation import Neutral, Observation, observe
from fba.persona._persona import Persona
from fba.persona.motion import describe_motion
from fba.persona.points import TrackedFace
from fba.persona.points.layout import PARTS, standard_mask, triangles
from fba.persona.recognition import ClassRecogniser

MASK_SIZE = (150, 170)
"""Width and height of the picture of a mask, pixels."""
PLOT_SIZE = (360, 260)
"""Width and height of a plot, pixels."""
DRAWN_MASKS = 4
"""Number of masks of a class that are drawn."""
MAX_DOTS = 400
"""Largest number of frames or examples in a plot."""
COLOURS = ("#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#17becf", "#8c564b", "#e377c2")
STYLE = (
    "body{font:15px sans-serif;max-width:75em;margin:2em auto;padding:0 1em;color:#222}"
    "figure{display:inline-block;margin:4px;text-align:center;font-size:12px}"
    "table{border-collapse:collapse}td,th{padding:2px 10px;text-align:right;border-bottom:1px solid #ddd}"
    "td:first-child,th:first-child{text-align:left}svg{background:#fafafa}"
)


def make_report(
    persona: Persona,
    faces: Sequence[TrackedFace],
    *,
    neutral: Neutral = None,
    warm_up: int = 0,
    recogniser: ClassRecogniser | None = None,
) -> str:
    """Return an HTML page about a Persona learnt from these recordings; options as for `learn`."""
    known = ClassRecogniser.default() if recogniser is None else recogniser
    seen = [observe(face, known, neutral, warm_up=warm_up) for face in faces]
    name = html.escape(persona.name or "actor")
    body = [f"<h1>Persona of {name}</h1>", _counts(persona), "<h2>Classes and masks</h2>"]
    for part in PARTS:
        body += _part_masks(persona, part, known)
    body += ["<h2>Motion</h2>", _motion(persona), "<h2>Components</h2>", _variance(known)]
    body.append("<h2>Frames among the examples</h2>")
    body.append(
        "<p>Grey: examples from which expressions are recognised. Coloured: the actor's frames of the most "
        "frequent classes; the line joins them in time.</p>"
    )
    for part in PARTS:
        body += [_scatter(part, seen, known, axes) for axes in ((0, 1), (1, 2))]
    page = "\n".join(body)
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>Persona of {name}</title>'
        f"<style>{STYLE}</style></head>\n<body>\n{page}\n</body></html>\n"
    )


def _counts(persona: Persona) -> str:
    return (
        f"<p>{persona.kept} of {persona.frames} frames are used; {persona.untracked} have no face; in "
        f"{persona.turned} the head is turned by more than 30 degrees. Masks take {persona.size} bytes.</p>"
    )


def _motion(persona: Persona) -> str:
    motion = describe_motion(persona.motions)
    if motion is None:
        return "<p>The file of this Persona has no statistics of motion.</p>"
    rows = [
        f"<tr><td>{part.replace('_', ' ')}</td><td>{values['millimetres']:.2f}</td>"
        f"<td>{values['speed']:.1f}</td></tr>"
        for part, values in motion["parts"].items()
    ]
    sides = ", ".join(f"{name} {times:.2f}" for name, times in motion["left_over_right"].items())
    return (
        "<p>Amplitude of each part about its mean, on the standard face, and its speed relative to that. "
        f"Amplitude of the left side relative to the right: {sides}.</p>"
        f"<table><tr><th></th><th>mm</th><th>1/s</th></tr>{''.join(rows)}</table>"
    )


def _part_masks(persona: Persona, part: str, known: ClassRecogniser) -> list[str]:
    style = persona.parts[part]
    missing = persona.missing({part: known.components[part].classes for part in PARTS})[part]
    result = [f"<h3>{part.replace('_', ' ')}: {len(style.rows)} classes, {len(style.labels)} masks</h3>"]
    if missing:
        result.append(f"<p>Missing: {html.escape(', '.join(missing))}</p>")
    for name, rows in sorted(style.rows.items(), key=lambda item: -len(item[1])):
        sizes = np.linalg.norm(style.moved[rows], axis=(1, 2))
        places = np.linspace(0, len(rows) - 1, min(DRAWN_MASKS, len(rows))).astype(int)
        chosen = rows[np.argsort(sizes)[places]]
        pictures = "".join(draw_mask(persona.mask(part, int(row)), persona.neutral_mask) for row in chosen)
        frames = ", ".join(f"{style.source[row]}:{style.frame[row]}" for row in chosen)
        result.append(
            f"<figure>{pictures}<figcaption>{html.escape(name)}: {len(rows)} masks, of frames "
            f"{frames}</figcaption></figure>"
        )
    return result


def draw_mask(mask: Float64, behind: Float64 | None = None) -> str:
    """Return an SVG picture of a mask (86, 3), black, in front of another, grey."""
    size = np.ptp(standard_mask()[:, :2], axis=0)
    middle = standard_mask()[:, :2].min(axis=0) + size / 2
    scale = min(MASK_SIZE[0] / size[0], MASK_SIZE[1] / size[1]) * 0.92

    def path(points: Float64) -> str:
        at = (points[:, :2] - middle) * (scale, -scale) + np.array(MASK_SIZE) / 2
        corners = np.round(at[triangles()], 1).tolist()
        return "".join(f"M{a[0]} {a[1]}L{b[0]} {b[1]}L{c[0]} {c[1]}Z" for a, b, c in corners)

    lines = (
        "" if behind is None else f'<path d="{path(behind)}" fill="none" stroke="#ccc" stroke-width=".5"/>'
    )
    lines += f'<path d="{path(mask)}" fill="none" stroke="#222" stroke-width=".7"/>'
    return f'<svg width="{MASK_SIZE[0]}" height="{MASK_SIZE[1]}">{lines}</svg>'


def _variance(known: ClassRecogniser) -> str:
    rows = [
        f"<tr><td>{part.replace('_', ' ')}</td>"
        + "".join(f"<td>{100 * share:.1f} %</td>" for share in np.cumsum(component.variance)[:5])
        + f"<td>{len(component.axes)}</td><td>{100 * component.kept_variance:.1f} %</td>"
        + f"<td>{100 * component.share:.1f} %</td></tr>"
        for part, component in known.components.items()
    ]
    head = "".join(f"<th>{number}</th>" for number in range(1, 6))
    return (
        f"<table><tr><th>variance of the first</th>{head}<th>kept</th><th>with</th><th>recognised</th></tr>"
        f"{''.join(rows)}</table>"
    )


def _scatter(part: str, seen: Sequence[Observation], known: ClassRecogniser, axes: tuple[int, int]) -> str:
    """Return an SVG plot of two components of a part: examples, frames by class, and their path."""
    examples = known.scores[part][:, axes]
    frames = np.concatenate([take.scores[part] for take in seen])[:, axes]
    names = [name for take in seen for name in take.labels[part].names(known.components[part].classes)]
    low = np.minimum(np.percentile(examples, 0.5, axis=0), np.percentile(frames, 0.5, axis=0))
    high = np.maximum(np.percentile(examples, 99.5, axis=0), np.percentile(frames, 99.5, axis=0))
    scale = (np.array(PLOT_SIZE) - 20) / np.maximum(high - low, 1e-9)

    def place(points: Float64) -> list[list[float]]:
        at = np.clip((points - low) * scale + 10, 0, PLOT_SIZE)
        return np.round(np.stack([at[:, 0], PLOT_SIZE[1] - at[:, 1]], axis=1), 1).tolist()  # type: ignore[no-any-return]

    dots = [f'<circle cx="{x}" cy="{y}" r="1.2" fill="#ccc"/>' for x, y in place(_thin(examples))]
    path = " ".join(f"{x},{y}" for x, y in place(_thin(frames)))
    dots.append(f'<polyline points="{path}" fill="none" stroke="#888" stroke-width=".3"/>')
    common = sorted(set(names) - {""}, key=names.count, reverse=True)[: len(COLOURS)]
    legend = []
    for colour, name in zip(COLOURS, common, strict=False):
        members = frames[[n for n, other in enumerate(names) if other == name]]
        dots += [f'<circle cx="{x}" cy="{y}" r="2" fill="{colour}"/>' for x, y in place(_thin(members))]
        legend.append(f'<span style="color:{colour}">{html.escape(name)}</span>')
    caption = f"{part.replace('_', ' ')}, components {axes[0] + 1} and {axes[1] + 1}: {' '.join(legend)}"
    picture = f'<svg width="{PLOT_SIZE[0]}" height="{PLOT_SIZE[1]}">{"".join(dots)}</svg>'
    return f"<figure>{picture}<figcaption>{caption}</figcaption></figure>"


def _thin(points: Float64) -> Float64:
    """Return at most `MAX_DOTS` of the points, evenly chosen."""
    return points[:: max(1, -(-len(points) // MAX_DOTS))]
