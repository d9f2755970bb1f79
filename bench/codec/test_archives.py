"""Archives beside other ways to keep motion for training: bytes, and random windows of 400 frames a second.

All hold the same performances: the FAPs that a face shows, (frames, 68). "FBA exact" keeps every value, "FBA
within 0.5 mm" what is seen. Real captures where the shared material is there, and synthetic ones, in which
all FAPs move. Windows are drawn in the same random order from each, on one core, warm.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fba
from bench.conftest import SHARED, synthetic
from fba import Animation
from fba.capture import to_blendshapes
from fba.errors import FbaWarning
from fba.face import Deformer, FaceModel, resolve

pytest.importorskip("pyarrow")

from fba.archive import Archive, Coding, Windows, find_sources, make_archive

pytestmark = pytest.mark.benchmark(timer=time.process_time)  # of one core, whoever else uses the machine
FRAMES = 400
DRAWN = 100
CAPTURES = ("livelink_163_cal_600rows.csv", "livelink_capture.udp", "mediapipe_WolfgangLanger_Pexels.csv")

Draw = Callable[[int, int], np.ndarray]


@dataclass(frozen=True)
class Store:
    """A way to keep performances. size: its bytes. draw: a window, by number of the clip and first frame."""

    name: str
    size: int
    draw: Draw | None


def captured() -> list[Animation]:
    folder = SHARED / "data" / "capture"
    if not folder.is_dir():
        pytest.skip("no shared test material; set FBA_SHARED to its folder")
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        return [fba.read(folder / name) for name in CAPTURES]


@pytest.fixture(scope="module", params=["captures", "synthetic"])
def clips(request: pytest.FixtureRequest) -> list[Animation]:
    if request.param == "synthetic":
        return [synthetic(1500, seed) for seed in range(2)]
    return [clip for clip in captured() if len(clip) >= FRAMES + 30]


def stores(clips: list[Animation], folder: Path) -> Iterator[Store]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    values = [np.ascontiguousarray(resolve(clip.face)) for clip in clips if clip.face is not None]
    names = [f"c{number}" for number in range(68)]

    def size(suffix: str) -> int:
        return sum(path.stat().st_size for path in folder.glob(f"*{suffix}"))

    for number, clip in enumerate(values):
        clip.tofile(folder / f"{number}.raw")
        np.savez_compressed(folder / f"{number}.npz", faps=clip)
        columns = {name: clip[:, column] for column, name in enumerate(names)}
        pq.write_table(
            pa.table(columns), folder / f"{number}.columns", compression="ZSTD", row_group_size=FRAMES
        )
    maps = [np.memmap(folder / f"{n}.raw", np.float32, "r", shape=one.shape) for n, one in enumerate(values)]
    yield Store(
        "float32, memory-mapped", size(".raw"), lambda clip, at: np.array(maps[clip][at : at + FRAMES])
    )
    yield Store(
        "npz a clip, compressed", size("[0-9].npz"),
        lambda clip, at: np.load(folder / f"{clip}.npz")["faps"][at : at + FRAMES],
    )  # fmt: skip

    deformer = Deformer(FaceModel.default())
    for number, (clip, shown) in enumerate(zip(clips, values, strict=True)):
        weights = to_blendshapes(clip).weights.astype(np.float32)
        np.savez_compressed(folder / f"{number}.weights.npz", weights=weights)
        points = deformer.feature_points(shown).astype(np.float32)
        np.savez_compressed(folder / f"{number}.points.npz", points=points)
    yield Store("the same as npz of ARKit weights", size(".weights.npz"), None)
    yield Store("the same as npz of feature points", size(".points.npz"), None)

    def from_columns(clip: int, at: int) -> np.ndarray:
        groups = range(at // FRAMES, (at + FRAMES - 1) // FRAMES + 1)
        table = files[clip].read_row_groups(list(groups), use_threads=False)
        rows = np.stack([column.to_numpy() for column in table.columns], axis=1)
        return rows[at - groups[0] * FRAMES :][:FRAMES]

    files = [pq.ParquetFile(folder / f"{number}.columns", pre_buffer=False) for number in range(len(values))]
    yield Store("Parquet of float32 columns, zstd", size(".columns"), from_columns)
    try:
        import h5py
    except ImportError:
        pass
    else:
        with h5py.File(folder / "all.h5", "w") as file:
            for number, clip in enumerate(values):
                file.create_dataset(
                    str(number), data=clip, chunks=(FRAMES, 68), compression="gzip", shuffle=True
                )
        opened = h5py.File(folder / "all.h5")
        yield Store("HDF5, shuffled, gzip", size(".h5"), lambda clip, at: opened[str(clip)][at : at + FRAMES])
        opened.close()
    (folder / "takes").mkdir()
    for number, one in enumerate(clips):
        fba.write(folder / "takes" / f"{number}.fap", Animation(one.rate, one.index, one.face))
    for name, coding in (("FBA exact", Coding()), ("FBA within 0.5 mm", Coding(tolerance=0.0005))):
        reports = list(make_archive(find_sources([folder / "takes"]), folder / name, coding=coding))
        assert [one.error for one in reports] == [""] * len(clips)
        shards = sum(path.stat().st_size for path in (folder / name).iterdir())
        yield Store(
            f"{name}, the streams alone", sum(len(one.stream) for one in Archive(folder / name)), None
        )
        starts = np.cumsum([0, *(len(one) - FRAMES + 1 for one in values)])
        for kind in ("faps", "arkit", "points"):
            for keep, how in ((0, "decoded each time"), (64 << 20, "frames kept")):
                windows = Windows(folder / name, FRAMES, 1, as_=kind, keep=keep)
                yield Store(f"{name}, {kind}, {how}", shards, _draw(windows, starts))


def _draw(windows: Windows, starts: np.ndarray) -> Draw:
    return lambda clip, at: np.asarray(windows[int(starts[clip]) + at])


def test_sizes_and_random_windows(
    benchmark: Any, clips: list[Animation], tmp_path: Path, report: Callable[[str], None]
) -> None:
    random = np.random.default_rng(0)
    drawn = [
        (clip, int(random.integers(len(clips[clip]) - FRAMES)))
        for clip in random.integers(len(clips), size=DRAWN).tolist()
    ]
    seconds = sum(float(clip.duration) for clip in clips)
    measured = {}
    for store in stores(clips, tmp_path):
        draw = store.draw
        if draw is None:
            measured[store.name] = (store.size, 0.0)
            continue
        assert len(draw(*drawn[0])) == FRAMES
        if "kept" in store.name:
            for clip, at in drawn:
                draw(clip, at)
        before = time.process_time()
        for clip, at in drawn:
            draw(clip, at)
        measured[store.name] = (store.size, DRAWN / (time.process_time() - before))
        last = draw
    benchmark.pedantic(last, drawn[0], rounds=20, warmup_rounds=2)
    npz = measured["npz a clip, compressed"][0]
    report(f"{len(clips)} performances, {seconds:.0f} s of FAPs, windows of {FRAMES} frames:")
    for name, (size, rate) in measured.items():
        text = f", {rate:8.0f} windows/s" if rate else ""
        report(f"  {name:46} {size:9} bytes, npz / this {npz / size:6.1f}{text}")
    benchmark.extra_info.update(
        {name: {"bytes": size, "windows": rate} for name, (size, rate) in measured.items()}
    )
