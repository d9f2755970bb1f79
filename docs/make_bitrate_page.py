"""Makes docs/bitrate.md and its pictures from bench/results: `python docs/make_bitrate_page.py`; needs matplotlib.

The results are measured by `fba bench bitrate`; nothing on the page is written by hand that could be measured.
"""

from __future__ import annotations

from pathlib import Path

from fba.study import Result, make_pictures, read_results, summary_lines
from fba.study.choices import OWN, best_within, compare, group_results, rivals_of, smallest_live, together
from fba.study.page import make_section, method_text
from fba.study.points import UNPLANNED
from fba.study.summary import LIMITS, subjects_text
from fba.study.tables import comparison_table, error_text, published_table, rate_text, settings_table

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "bench" / "results"
PAGE = ROOT / "docs" / "bitrate.md"
IMAGES = ROOT / "docs" / "images"
RECORDINGS = ("recordings-faces.csv", "recordings-bodies.csv")
SAMPLES = "samples.csv"

INTRODUCTION = """\
# How small? The study of bit rates

What faces and bodies take as FBA, how far off that is, and what other ways need for the same values:

{summary}

*Live* means that every frame leaves at once; *other* ways are general-purpose compressors, which get the very values that a
decoder of the FBA stream returns. Rates are without packet headers.

- **Streams**: FBA is the smallest. {faces} take {exact} kbit/s with everything that is shown kept exactly, {near} with no vertex
  of the face more than {near_error} mm off. The best of the others, deflate that is flushed after every frame, takes
  {deflate} and {near_deflate}, if it leaves out the same FAPs as FBA and without loss {deflate_all} if it does not. Live Link Face
  sends 153.
- **Files**: FBA is not the smallest. Brotli over whole columns takes {brotli} kbit/s for the same, because it finds whatever
  repeats anywhere. To store recordings, use that, or an FBA file for what reads FBA.
- **Packets**: 40 bytes of RTP, UDP and IP headers are 8 kbit/s at 25 packets a second, more than any of these streams. Below
  2 kbit/s, it pays to put several frames into a packet before anything else.
"""

DATA = """\
The recordings are {faces} of streams of real applications that move low-level FAPs (speech and gestures of the head, 25 frames a
second), and {bodies}: one stream, and BVH files of ten makers, as `fba encode` converts them. They may not be passed on, so
only their figures are here (`bench/results`). [The samples](#the-samples) can be measured by anyone.
"""

LOSSES = """\
## Where FBA loses

- **Files.** Column by column, brotli, xz and zstd are smaller than FBA at every error, for faces and for bodies: they look at all
  frames before they write the first, and find columns that equal others and motions that repeat. FBA's arithmetic coder learns
  as it goes.
- **Live, with nothing known before.** An encoder that knows neither the ranges of what comes nor which FAPs will stay equal takes
  {unplanned} kbit/s for the faces and {unplanned_body} for the bodies, more than deflate ({deflate_all} and
  {deflate_body}), which adapts its alphabet to what comes. FBA's figures above are of streams whose recording is known: a
  performance that is streamed, not one that is captured at that moment.
- **Bodies within a tenth of a millimetre.** The finest quantiser leaves {body_error} mm at the worst joint of the worst
  frame, {body_99} mm in 99 % of samples. The Animation Compression Library's 0.1 mm are out of FBA's reach; its 15.6 kbit/s are of
  other data, files, and that much more accurate.
- **Short streams.** An adaptive model starts without knowledge, and each I plane starts it again: a few seconds cost up to twice
  the rate of a long stream (the tables of single files below show it).
"""

AGAIN = """\
## Measure it again

The extra `study` brings what FBA is compared with; rows of packages that are missing are left out.

```console
pip install '.[study]'
fba bench bitrate -o study
fba bench bitrate talk.fba walk.bvh --title "my recordings" -o mine --summary
fba bench bitrate --results study/results.csv --results mine/results.csv --summary
```

The first measures the samples that come with `fba`, the second your own files: streams, captures, whatever `fba` reads. Both write
`results.csv`, plots, and a page of tables; the last prints the table at the top of this page from numbers measured before. Each
second of animation takes about a second. This page is made from `bench/results` by `python docs/make_bitrate_page.py`.
"""


def main() -> None:
    """Write the page and its pictures."""
    recordings = [one for name in RECORDINGS for one in read_results(RESULTS / name)]
    for name, data in make_pictures(recordings).items():
        (IMAGES / name).write_bytes(data)
    PAGE.write_text(make_page(), encoding="utf-8")


def make_page() -> str:
    """Return the page of the results in bench/results."""
    faces, bodies = (read_results(RESULTS / name) for name in RECORDINGS)
    samples = read_results(RESULTS / SAMPLES)
    values = {"summary": "\n".join(summary_lines([*faces, *bodies, *samples])), **_figures(faces, bodies)}
    parts = [INTRODUCTION.format(**values), DATA.format(**values)]
    for title, group in (("## Faces", faces), ("## Bodies", bodies)):
        parts.append("\n".join([title, "", *make_section(group, "images/")]))
    parts.append(LOSSES.format(**values))
    parts.append("\n".join(["## The samples", "", *_samples(samples)]))
    parts.append("\n".join(["## Published rates of others", "", "On data of their own.", "", *published_table(), ""]))
    return "\n".join([*parts, AGAIN, method_text()])


def _figures(faces: list[Result], bodies: list[Result]) -> dict[str, str]:
    """Return the numbers in the text, by name."""
    exact, near = compare(faces)[0], best_within(faces, LIMITS["face"])
    body = compare(bodies)[0]
    return {
        "faces": subjects_text(exact.own),
        "bodies": subjects_text(body.own),
        "exact": rate_text(exact.own.live_rate),
        "near": rate_text(near.own.live_rate),
        "near_error": error_text(near.own.max_mm),
        "deflate": rate_text(exact.live.live_rate),
        "near_deflate": rate_text(near.live.live_rate),
        "deflate_all": rate_text(_live_of_all(faces, exact.own)),
        "deflate_body": rate_text(_live_of_all(bodies, body.own)),
        "brotli": rate_text(exact.file.file_rate),
        "unplanned": rate_text(_unplanned(faces)),
        "unplanned_body": rate_text(_unplanned(bodies)),
        "body_error": error_text(body.own.max_mm),
        "body_99": error_text(body.own.p99_mm),
    }


def _live_of_all(group: list[Result], own: Result) -> float | None:
    """Return the smallest live rate of others that send all numbers."""
    found = smallest_live(one for one in rivals_of(together(group), own) if one.numbers == "all")
    return None if found is None else found.live_rate


def _unplanned(group: list[Result]) -> float | None:
    """Return the live rate of FBA with nothing known before."""
    return next(one.live_rate for one in together(group) if one.method == UNPLANNED and one.numbers == OWN)


def _samples(samples: list[Result]) -> list[str]:
    lines = [
        "`hello.fap`, `talk.c3d` and `hello.bvh` come with `fba`; scripts made them. They move more smoothly and more of the",
        "face than recordings do, without equal halves of a face, so there is less to leave out.",
        "",
    ]
    for group in group_results(samples):
        lines += [f"### {subjects_text(compare(group)[0].own)}", "", *comparison_table(group), ""]
        lines += ["All settings of FBA:", "", *settings_table(group), ""]
    return lines


if __name__ == "__main__":
    main()
