"""Archives: many performances in a few Parquet files, which trainers, SQL and any Parquet reader read.

    sources = label_by_folders(find_sources([Path("takes")]), ["subject", "emotion"])
    for report in make_archive(sources, "archive"): ...
    windows = Windows("archive", frames=400, as_="faps")     # windows[7] is float32 (400, 68)

A row is a performance: its FBA stream, and what one asks before decoding it. May use: the codec, planning,
faces, bodies, emotions, formats, and the planes that `fba.serving` splits streams into. Parquet is read and
written by the package pyarrow, queries are answered by duckdb: the extra `archive`.
"""

from fba.archive._batch import RECORD, Conversion, convert_batch
from fba.archive._cluster import for_each_on
from fba.archive._index import Indexed, index_archive, query
from fba.archive._locations import Location, RemotePath, find_location
from fba.archive._making import (
    Check,
    Report,
    describe_archive,
    extract,
    make_archive,
    units_of,
    verify_archive,
)
from fba.archive._performance import DEFAULT_PERIOD, Coding, Performance
from fba.archive._pool import CHUNK, Outcome, count_processors, for_each
from fba.archive._shards import Archive
from fba.archive._sources import Source, check_levels, find_sources, label_by_folders, label_by_table
from fba.archive._windows import KINDS, Kind, Windows

__all__ = [
    "CHUNK", "DEFAULT_PERIOD", "KINDS", "RECORD", "Archive", "Check", "Coding", "Conversion", "Indexed",
    "Kind", "Location", "Outcome", "Performance", "RemotePath", "Report", "Source", "Windows",
    "check_levels", "convert_batch", "count_processors", "describe_archive", "extract", "find_location",
    "find_sources", "for_each", "for_each_on", "index_archive", "label_by_folders", "label_by_table",
    "make_archive", "query", "units_of", "verify_archive",
]  # fmt: skip
