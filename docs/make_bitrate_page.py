"""Makes docs/bitrate.md and its pictures from bench/results: `python docs/make_bitrate_page.py`.

Needs matplotlib. `./dev bitrate` measured the results; the words are in bench/results/page.md.
"""

from __future__ import annotations

from pathlib import Path

from bench.bitrate import Result, make_pictures, read_results, summary_lines
from bench.bitrate.choices import OWN, best_within, compare, group_results, rivals_of, smallest_live, together
from bench.bitrate.page import make_section, method_text
from bench.bitrate.points import KNOWN, UNPLANNED
from bench.bitrate.tables import (
    LIMITS,
    comparison_table,
    error_text,
    published_table,
    rate_text,
    settings_table,
    subjects_text,
)

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "bench" / "results"
PAGE = ROOT / "docs" / "bitrate.md"
IMAGES = ROOT / "docs" / "images"
RECORDINGS = ("recordings-faces.csv", "recordings-bodies.csv")
SAMPLES = "samples.csv"

TEMPLATE = RESULTS / "page.md"


def main() -> None:
    """Write the page and its pictures."""
    pictures()
    PAGE.write_text(make_page(), encoding="utf-8")


def pictures() -> None:
    """Write the pictures of the page."""
    recordings = [one for name in RECORDINGS for one in read_results(RESULTS / name)]
    for name, data in make_pictures(recordings).items():
        (IMAGES / name).write_bytes(data)


def make_page() -> str:
    """Return the page of the results in bench/results."""
    faces, bodies = (read_results(RESULTS / name) for name in RECORDINGS)
    samples = read_results(RESULTS / SAMPLES)
    return TEMPLATE.read_text(encoding="utf-8").format(
        summary="\n".join(summary_lines([*faces, *bodies, *samples])),
        faces_section="\n".join(make_section(faces, "images/")),
        bodies_section="\n".join(make_section(bodies, "images/")),
        samples_section="\n".join(_samples(samples)),
        published="\n".join(published_table()),
        method=method_text(),
        **_figures(faces, bodies),
    )


def _figures(faces: list[Result], bodies: list[Result]) -> dict[str, str]:
    """Return the numbers in the text, by name."""
    exact, near = compare(faces)[0], best_within(faces, LIMITS["face"])
    body, near_body = compare(bodies)[0], best_within(bodies, LIMITS["body"])
    rounded = max(
        (
            one.own
            for one in compare(faces)
            if "quantiser" in one.own.point and one.own.max_mm <= LIMITS["face"]
        ),
        key=lambda own: own.max_mm,
    )
    return {
        "face_count": str(exact.own.subjects),
        "face_seconds": f"{exact.own.seconds:.0f}",
        "body_count": str(body.own.subjects),
        "body_seconds": f"{body.own.seconds:.0f}",
        "exact": rate_text(exact.own.live_rate),
        "near": rate_text(near.own.live_rate),
        "near_error": error_text(near.own.max_mm),
        "deflate": rate_text(exact.live.live_rate),
        "near_deflate": rate_text(near.live.live_rate),
        "deflate_all": rate_text(_live_of_all(faces, exact.own)),
        "deflate_body": rate_text(_live_of_all(bodies, body.own)),
        "rounded": rate_text(_live_of_all(faces, rounded)),
        "rounded_error": error_text(rounded.max_mm),
        "brotli": rate_text(exact.file.file_rate),
        "near_brotli": rate_text(near.file.file_rate),
        "unplanned": rate_text(_live_rate(faces, UNPLANNED)),
        "unplanned_body": rate_text(_live_rate(bodies, UNPLANNED)),
        "known": rate_text(_live_rate(faces, KNOWN)),
        "known_body": rate_text(_live_rate(bodies, KNOWN)),
        "near_body": rate_text(near_body.own.live_rate),
        "near_body_error": error_text(near_body.own.max_mm),
        "near_body_feet": error_text(near_body.own.feet_mm),
        "near_body_deflate": rate_text(near_body.live.live_rate),
        "body_error": error_text(body.own.max_mm),
        "body_99": error_text(body.own.p99_mm),
    }


def _live_of_all(group: list[Result], own: Result) -> float | None:
    """Return the smallest live rate of others that send all numbers."""
    found = smallest_live(one for one in rivals_of(together(group), own) if one.numbers == "all")
    return None if found is None else found.live_rate


def _live_rate(group: list[Result], method: str) -> float | None:
    """Return the live rate of one of FBA's methods."""
    own = [one for one in together(group) if one.numbers == OWN]
    return next(one.live_rate for one in own if (one.method, one.point) == (method, "quantiser 1"))


def _samples(samples: list[Result]) -> list[str]:
    lines = []
    for group in group_results(samples):
        lines += [f"### {subjects_text(compare(group)[0].own)}", "", *comparison_table(group), ""]
        lines += ["All settings of FBA:", "", *settings_table(group), ""]
    return lines


if __name__ == "__main__":
    main()
