"""The bitrate study: what faces and bodies take as FBA and as what else there is, at the same error.

May use: planning, face, body, the codec; zstandard, brotli, meshopt and matplotlib where they are installed.
"""

from bench.bitrate.measurement import measure
from bench.bitrate.page import make_page, make_pictures
from bench.bitrate.results import Result, read_results, results_csv
from bench.bitrate.subjects import Subject, split_subjects
from bench.bitrate.tables import summary_lines

__all__ = [
    "Result", "Subject", "make_page", "make_pictures", "measure", "read_results", "results_csv",
    "split_subjects", "summary_lines",
]  # fmt: skip
