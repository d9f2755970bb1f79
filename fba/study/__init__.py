"""The bitrate study: what faces and bodies take as FBA and as what else there is, at the same error.

May use: planning, face, body, the codec; zstandard, brotli, meshopt and matplotlib where they are installed.
"""

from fba.study.measurement import measure
from fba.study.page import make_page, make_pictures
from fba.study.results import Result, read_results, results_csv
from fba.study.subjects import Subject, split_subjects
from fba.study.summary import summary_lines

__all__ = [
    "Result",
    "Subject",
    "make_page",
    "make_pictures",
    "measure",
    "read_results",
    "results_csv",
    "split_subjects",
    "summary_lines",
]
