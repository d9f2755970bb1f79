"""`fba.archive.Windows`: equal to whole performances converted, in processes, and by its options."""

import multiprocessing
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import archived
import fba
from fba.archive import KINDS, Archive, Coding, Performance, Windows
from fba.body import BapSolver, Skeleton
from fba.capture import to_blendshapes
from fba.errors import FormatError, OptionError
from fba.face import Deformer, FaceModel, arkit_names, resolve
from fba.parameters import BAP_COUNT
from fba.tracks import hold


def convert_whole(animation: fba.Animation, kind: str) -> Any:
    """What a whole performance becomes, by the library's other functions."""
    if kind in ("baps", "joints"):
        body = archived.body_of(animation)
        values = hold(body.values, body.mask, np.zeros(BAP_COUNT, np.int32))
        return values if kind == "baps" else BapSolver(Skeleton.default()).pose(values)[:, :, :3, 3]
    shown = resolve(archived.face_of(animation))
    return shown if kind == "faps" else Deformer(FaceModel.default()).feature_points(shown)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "arkit"])
def test_windows_are_parts_of_whole_performances(archive: Path, kind: Any) -> None:
    windows = Windows(archive, 60, 23, as_=kind)
    wholes = {one.name: one.decode() for one in Archive(archive)}
    part = "face" if kind in ("faps", "points") else "body"
    converted = {
        name: convert_whole(whole, kind) for name, whole in wholes.items() if getattr(whole, part) is not None
    }
    assert len(windows) == 9 * len(converted)
    order = np.random.default_rng(0).permutation(len(windows))
    for position in order:
        window, about = windows[position], windows.describe(position)
        assert (window.dtype, window.flags.c_contiguous, window.flags.owndata) == (np.float32, True, True)
        cut = slice(about["frame"], about["frame"] + 60)
        expected = converted[about["name"]][cut]
        assert window.shape == (60, len(windows.names), *expected.shape[2:])
        np.testing.assert_array_equal(window, expected.astype(np.float32))


def test_weights_of_windows(archive: Path) -> None:
    """Visemes and held FAPs from before the window count: the weights are those of the performance."""
    windows = Windows(archive, 60, 99, as_="arkit")
    wholes = {one.name: to_blendshapes(one.decode()).weights for one in Archive(archive) if one.face}
    for position, window in enumerate(windows):
        about = windows.describe(position)
        weights = wholes[about["name"]][about["frame"] : about["frame"] + 60]
        np.testing.assert_allclose(window, weights, atol=1e-7)


@pytest.mark.parametrize("as_", ["faps", "joints"])
@pytest.mark.parametrize("rate", [None, 60, 12])
def test_windows_are_the_same_however_much_is_kept(
    archive: Path, monkeypatch: pytest.MonkeyPatch, as_: str, rate: int | None
) -> None:
    monkeypatch.setattr("fba.archive._windows.MOST_FRAMES", 37)  # parts end between I planes too
    kept = Windows(archive, 60, 7, as_=as_, rate=rate)
    none = Windows(archive, 60, 7, as_=as_, rate=rate, keep=0)
    few = Windows(archive, 60, 7, as_=as_, rate=rate, keep=100_000)
    order = np.random.default_rng(0).permutation(len(kept))
    for position in [*order, *order[:20]]:
        window = kept[position]
        np.testing.assert_array_equal(window, none[position])
        np.testing.assert_array_equal(window, few[position])
        window[:] = -1  # what the caller does with a window does not change those that are kept
    assert none._size == 0 < few._size <= 100_000 < kept._size
    assert few._size == sum(part.nbytes for part in few._parts.values())
    assert len(pickle.dumps(kept)) < 20_000


def test_kept_frames_are_not_decoded_again(archive: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    windows = Windows(archive, 60, 30)
    first = [windows[position] for position in range(len(windows))]
    monkeypatch.setattr(Performance, "decode_frames", None)
    for position, window in enumerate(first):
        np.testing.assert_array_equal(windows[position], window)
    with pytest.raises(OptionError, match="keep must be a number of bytes"):
        Windows(archive, 60, keep=-1)


def test_every_window_and_its_owner(archive: Path) -> None:
    windows = Windows(archive, 100, 1, as_="faps", performances=["ben/sad/masks"])
    assert len(windows) == 161
    whole = resolve(archived.face_of(Archive(archive)["ben/sad/masks"].decode()))
    for position in range(161):  # masks, visemes and expressions change at many places
        np.testing.assert_array_equal(windows[position], whole[position : position + 100])
    assert windows.describe(-1) == {
        "name": "ben/sad/masks", "subject": "ben", "labels": {"emotion": "sad"}, "sound_name": None,
        "frame": 160, "seconds": 6.4, "rate": 25.0,
    }  # fmt: skip


def test_frames_that_are_not_sent_are_filled_in(takes: Path, tmp_path: Path) -> None:
    """Within a tolerance, streams leave frames out, also around I planes."""
    (one,) = archived.make(takes / "anna/joy/talk.fap", tmp_path, coding=Coding(period=1, tolerance=0.02))
    assert one.error == ""
    talk = Archive(tmp_path)["talk"]
    assert talk.planes < talk.frames
    whole = resolve(archived.face_of(talk.decode().resample(25)))
    windows = Windows(tmp_path, 37, 11)
    for position in range(len(windows)):
        np.testing.assert_array_equal(windows[position], whole[11 * position : 11 * position + 37])


@pytest.mark.parametrize("rate", [10, 50, "30000/1001"])
def test_windows_at_another_rate(archive: Path, rate: Any) -> None:
    windows = Windows(archive, 40, 13, rate=rate, performances=["anna/joy/both", "anna/joy/talk"])
    wholes = {one.name: one.decode() for one in Archive(archive)}
    for position in range(len(windows)):
        about = windows.describe(position)
        whole = wholes[about["name"]]
        from_zero = fba.Animation(whole.rate, whole.index - whole.index[0], whole.face)
        shown = resolve(archived.face_of(from_zero.resample(fba.animation.Fraction(rate))))
        np.testing.assert_array_equal(windows[position], shown[about["frame"] : about["frame"] + 40])
    last = wholes["anna/joy/talk"].resample(fba.animation.Fraction(rate))
    per_performance = len(windows) // 2
    assert abs(per_performance - ((len(last) - 40) // 13 + 1)) <= 1


def test_columns_by_name_and_number(archive: Path) -> None:
    whole = Windows(archive, 50)
    chosen = Windows(archive, 50, parameters=["open_jaw", 48])
    assert chosen.names == ("open_jaw", "head_pitch")
    np.testing.assert_array_equal(chosen[3], whole[3][:, [2, 47]])
    shapes = Windows(archive, 50, as_="arkit", parameters=["jawOpen"])
    assert shapes.names == ("jawOpen",)
    np.testing.assert_array_equal(
        shapes[0][:, 0], Windows(archive, 50, as_="arkit")[0][:, arkit_names().index("jawOpen")]
    )
    points = Windows(archive, 50, as_="points", parameters=["2.1", "8.3"])
    assert points[0].shape == (50, 2, 3)
    assert Windows(archive, 50, as_="joints", parameters=["l_wrist"])[0].shape == (50, 1, 3)
    assert Windows(archive, 50, as_="baps", parameters=[184])[0].shape == (50, 1)


def test_a_sequence(archive: Path) -> None:
    windows = Windows(archive, 100)
    assert len(windows) == 6
    assert [one.shape for one in windows] == [(100, 68)] * 6
    np.testing.assert_array_equal(windows[-1], windows[5])
    assert [one.shape for one in windows[4:]] == [(100, 68)] * 2
    with pytest.raises(IndexError):
        windows[6]
    first = windows[0]
    first[:] = 9  # a new array each time
    assert not (windows[0] == 9).all()


def total(windows: Windows, positions: list[int], results: Any) -> None:
    results.put([float(windows[position].sum()) for position in positions])


@pytest.mark.parametrize(
    "method", ["spawn", *(["fork"] if "fork" in multiprocessing.get_all_start_methods() else [])]
)
@pytest.mark.filterwarnings("ignore:This process:DeprecationWarning")
def test_in_other_processes(archive: Path, method: str) -> None:
    """As the workers of a data loader get it, before and after it was used here."""
    windows = Windows(archive, 60, 7)
    expected = [float(one.sum()) for one in windows]
    context = multiprocessing.get_context(method)
    halves = [list(range(0, len(windows), 2)), list(range(1, len(windows), 2))]
    queues: list[Any] = [context.Queue() for _ in halves]
    workers = [
        context.Process(target=total, args=(windows, half, queue))
        for half, queue in zip(halves, queues, strict=True)
    ]
    for worker in workers:
        worker.start()
    found = [queue.get(timeout=300) for queue in queues]
    for worker in workers:
        worker.join()
    assert found == [[expected[position] for position in half] for half in halves]
    assert [float(one.sum()) for one in windows] == expected


def test_it_pickles_small(archive: Path) -> None:
    windows = Windows(archive, 60, 7, as_="points")
    unused = len(pickle.dumps(windows))
    for window in windows:
        assert np.isfinite(window[:, 0]).all()
    data = pickle.dumps(windows)
    assert len(data) <= unused + 100 < 10_000  # neither streams nor models
    np.testing.assert_array_equal(pickle.loads(data)[3], windows[3])


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"frames": 0}, OptionError, "frames must be a positive whole number, not 0"),
        ({"frames": 2.5}, OptionError, "frames must be"),
        ({"stride": -1}, OptionError, "stride must be"),
        ({"as_": "fap"}, OptionError, r"not 'fap' \(did you mean 'faps'"),
        ({"rate": 0}, OptionError, "the rate must be positive"),
        (
            {"parameters": ["open_jow"]},
            OptionError,
            r"no parameter 'open_jow' here \(did you mean 'open_jaw'",
        ),
        ({"parameters": [69]}, OptionError, "no parameter 69"),
        ({"parameters": []}, OptionError, "a list of names"),
        ({"parameters": [1], "as_": "arkit"}, OptionError, "no parameter 1"),
        ({"frames": 261}, FormatError, "no performance has a face and 261 frames; take shorter windows"),
        ({"performances": ["anna"]}, FormatError, "has no performance 'anna'"),
    ],
)
def test_wrong_arguments(
    archive: Path, arguments: dict[str, Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        Windows(archive, **{"frames": 50, **arguments})
