"""What `fba encode` and `fba convert` send unless told otherwise, and options that contradict each other."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import fba
import stored_models
from command_line import Run
from fba import Animation, BodyTrack, FaceTrack
from fba.codec import quantise
from fba.face import resolve
from fba.face.interpolation._node import Function, Link, Term
from fba.face.interpolation.table import InterpolationTable
from fba.planning import hold_still

SAMPLES = Path(fba.__file__).parent / "samples"


@pytest.fixture
def archive() -> Animation:
    """A face and a body of which much is sent and stays 0, with values between the quantiser's steps."""
    faps, baps = np.zeros((40, 68), dtype=np.int32), np.zeros((40, 296), dtype=np.int32)
    faps[:, 2] = np.arange(40) * 7  # open_jaw, in steps of 4
    faps[:, [11, 12]] = np.arange(40)[:, None] % 9  # both corners of the mouth
    baps[:, 183] = np.arange(40) * 5
    face_mask, body_mask = np.ones((40, 68), dtype=bool), np.ones((40, 296), dtype=bool)
    face_mask[:, :2] = False
    face_mask[20:, 30:40] = body_mask[:10, 100:] = False
    return Animation(
        25, np.arange(40), FaceTrack(faps * face_mask, face_mask), BodyTrack(baps * body_mask, body_mask)
    )


@pytest.mark.parametrize("command", ["encode", "convert"])
@pytest.mark.parametrize(("part", "suffix"), [("face", "fap"), ("body", "bap")])
def test_text_files_come_back_as_they_were(
    run: Run, tmp_path: Path, archive: Animation, command: str, part: str, suffix: str
) -> None:
    given, back = tmp_path / f"a.{suffix}", tmp_path / f"b.{suffix}"
    parts = {"face": archive.face, "body": archive.body}
    fba.write(given, Animation(25, archive.index, parts["face"] if part == "face" else None,
                               parts["body"] if part == "body" else None, name="a"))  # fmt: skip
    target = ("-o", tmp_path / "a.fba") if command == "encode" else (tmp_path / "a.fba",)
    done = run(command, given, *target)
    assert done.err == ""
    assert "rounded" not in done.out
    run("decode", tmp_path / "a.fba", f"--{suffix}", back)
    assert back.read_bytes() == given.read_bytes()


def test_rounded_values_are_counted(run: Run, tmp_path: Path, archive: Animation) -> None:
    """Steps of the eyes are 128: where no stream carries values as they are, that is said."""
    values = archive.face.values.copy()
    values[0, 22] = 2000  # yaw_l_eyeball
    fba.write(tmp_path / "a.fap", Animation(25, archive.index, FaceTrack(values, archive.face.mask)))
    done = run("encode", tmp_path / "a.fap", "-o", tmp_path / "a.fba")
    wrong = (fba.read(tmp_path / "a.fba").face.values != values).sum()  # type: ignore[union-attr]
    assert done.out.endswith(f"; {wrong} values rounded to quantiser steps\n")
    done = run("encode", tmp_path / "a.fap", "-o", tmp_path / "a.fba", "--quant", 1)
    assert not done.out.endswith("rounded to quantiser steps\n")


def test_streams_leave_out_what_never_moves(run: Run, tmp_path: Path, archive: Animation) -> None:
    fba.write(tmp_path / "a.fba", archive)
    for arguments in (("encode", "-o"), ("convert",)):
        run(arguments[0], tmp_path / "a.fba", *arguments[1:], tmp_path / "b.fba")
        before, after = fba.read(tmp_path / "a.fba"), fba.read(tmp_path / "b.fba")
        # The outer lips are sent, too: a player would copy the inner ones.
        assert set(np.flatnonzero(after.face.mask[5])) == {2, 11, 12, 58, 59}
        assert set(np.flatnonzero(after.body.mask[15])) == {183}
        assert np.array_equal(after.face.values, before.face.values)  # type: ignore[union-attr]
        assert np.array_equal(after.body.values, before.body.values)  # type: ignore[union-attr]
    run("encode", tmp_path / "a.fba", "-o", tmp_path / "b.fba", "--preset", "reference")
    assert fba.read(tmp_path / "b.fba").face.mask[5].sum() == 66  # type: ignore[union-attr]


def test_captured_faces_send_what_a_player_does_not_derive(
    run: Run, tmp_path: Path, archive: Animation
) -> None:
    assert archive.face is not None
    fba.write(
        tmp_path / "a.csv", Animation(25, archive.index, archive.face)
    )  # blendshapes, alike on both sides
    run("encode", tmp_path / "a.csv", "-o", tmp_path / "all.fba", "--preset", "reference")
    everything = fba.read(tmp_path / "all.fba").face
    for arguments in (("encode", "-o"), ("convert",)):
        run(arguments[0], tmp_path / "a.csv", *arguments[1:], tmp_path / "b.fba")
        face = fba.read(tmp_path / "b.fba").face
        assert face.mask[:, [11, 12]].sum() == len(face)
        assert everything.mask[:, [11, 12]].all()
        assert np.array_equal(resolve(face), resolve(everything))
    # A FAP file beside captured motion is an archive still.
    fba.write(tmp_path / "a.fap", Animation(25, archive.index, archive.face))
    given = (tmp_path / "a.fap", SAMPLES / "hello.bvh", "-o", tmp_path / "c.fba")
    run("encode", *given)
    assert fba.read(tmp_path / "c.fba", bap_steps="visage").face.mask[5, [11, 12]].all()


@pytest.mark.parametrize(
    "options", [("--preset", "exact"), ("--bap-quant", 3), ("--unsent", "keep"), ("--time-codes",)]
)
def test_an_epf_file_says_it_all(
    run: Run, tmp_path: Path, archive: Animation, options: tuple[str, ...]
) -> None:
    fba.write(tmp_path / "a.fap", Animation(25, archive.index, archive.face))
    (tmp_path / "a.epf").write_text("")
    done = run(
        "encode", tmp_path / "a.fap", "-o", tmp_path / "a.fba", "--epf", tmp_path / "a.epf", *options, code=2
    )
    assert f"{options[0]} and --epf contradict each other" in " ".join(done.err.split())


def test_unknown_presets(run: Run, tmp_path: Path, archive: Animation) -> None:
    fba.write(tmp_path / "a.fba", archive)
    done = run("encode", tmp_path / "a.fba", "-o", tmp_path / "b.fba", "--preset", "small", code=2)
    assert "'small' is not one of 'reference', 'exact', 'compact'" in " ".join(done.err.split())
    with pytest.raises(fba.OptionError, match="preset must be one of reference, exact, compact, not 'small'"):
        fba.write(tmp_path / "b.fba", archive, preset="small")
    fba.write(tmp_path / "b.fba", archive, preset="compact")
    assert (tmp_path / "b.fba").stat().st_size < (tmp_path / "a.fba").stat().st_size


def head(folder: Path, table: InterpolationTable | None) -> Path:
    path = folder / ("bare.glb" if table is None else "head.glb")
    stored_models.face(fit=table).save(path)
    return path


def test_faps_that_the_receivers_head_computes_are_not_sent(run: Run, tmp_path: Path) -> None:
    """Push_b_lip is twice open_jaw, by the head's own table."""
    function = Function([Term(2.0, {"open_jaw": 1})])
    model = head(tmp_path, InterpolationTable([Link(["open_jaw"], {"push_b_lip": function})]))
    values, mask = np.zeros((40, 68), dtype=np.int32), np.zeros((40, 68), dtype=bool)
    values[:, 2], values[:, 15] = np.arange(40) * 4, np.arange(40) * 8
    mask[:, [2, 15]] = True
    given, stream, back = tmp_path / "a.fap", tmp_path / "a.fba", tmp_path / "b.fap"
    fba.write(given, Animation(25, np.arange(40), FaceTrack(values, mask), name="a"))
    run("encode", given, "-o", stream, "--model", model)
    assert np.flatnonzero(fba.read(stream).face.mask.any(axis=0)).tolist() == [2]
    for outputs in (("--fap", back), ("--fap", back, "-o", tmp_path / "b.csv")):
        assert run("decode", stream, *outputs, "--shown", "--model", model).err == ""
        assert fba.read(back).face.values.tolist() == values.tolist()  # type: ignore[union-attr]
    run("decode", stream, "--fap", back, "--shown")
    assert not fba.read(back).face.values[:, 15].any()  # type: ignore[union-attr]
    assert (
        "--model says how to write --output"
        in run("decode", stream, "--fap", back, "--model", model, code=2).err
    )
    before = model.read_bytes()
    run("encode", given, "-o", model, "--model", model, code=2)
    assert model.read_bytes() == before


def test_heads_that_give_nothing(run: Run, tmp_path: Path, archive: Animation) -> None:
    given, out = tmp_path / "a.fba", tmp_path / "b.fba"
    fba.write(given, archive)
    bare = head(tmp_path, None)
    assert "bare.glb has no interpolation table (FIT)" in run("encode", given, "-o", out, "--model", bare).err
    with_model = out.read_bytes()
    run("encode", given, "-o", out, "--preset", "compact")
    assert out.read_bytes() == with_model
    for preset in ("reference", "exact"):
        done = run("encode", given, "-o", out, "--model", bare, "--preset", preset, code=2)
        assert f"--model and --preset {preset} contradict each other" in " ".join(done.err.split())


@pytest.mark.parametrize("suffix", ["fap", "bap"])
def test_files_without_frames_and_with_one_frame(
    run: Run, tmp_path: Path, archive: Animation, suffix: str
) -> None:
    one = replace(archive[:1], **{"body" if suffix == "fap" else "face": None})
    given, out = tmp_path / f"a.{suffix}", tmp_path / "a.fba"
    fba.write(given, one)
    lines = given.read_text().splitlines(keepends=True)
    empty = tmp_path / f"empty.{suffix}"
    empty.write_text(lines[0].replace(" 1\n", " 0\n"))
    for preset in ("reference", "exact", "compact"):
        assert run("encode", given, "-o", out, "--preset", preset).err == ""
        assert len(fba.read(out)) == 1
        done = run("encode", empty, "-o", out, "--preset", preset, code=1)
        assert f"{empty}: the file holds no frames" in done.err
    assert f"{empty}: the file holds no frames" in run("convert", empty, out, code=1).err


def test_captures_are_held_still_and_files_of_baps_are_not(run: Run, tmp_path: Path) -> None:
    """`--no-still` rounds, as for BAPs that are given as such; `--still` holds those, too."""
    capture, given = SAMPLES / "hello.bvh", tmp_path / "hello.bap"
    animation = fba.read(capture)
    options = fba.EncoderOptions(bap_steps="visage", clamp=True)
    run("convert", capture, given)
    rounded, still = (quantise(one, options).body for one in (animation, hold_still(animation, options)))
    sizes = []
    for source, arguments, expected in (
        (capture, (), still),
        (capture, ("--no-still",), rounded),
        (given, ("--bap-quant", "1", "--bap-steps", "visage", "--clamp"), rounded),
        (given, ("--still", "--bap-steps", "visage", "--clamp"), still),
    ):
        target = tmp_path / "a.fba"
        run("encode", source, "-o", target, *arguments)
        apart = np.abs(fba.read(target).body.values - expected.values)
        assert apart.max() <= (0 if expected is still else 256)  # rounding goes on from the frame before
        sizes.append(target.stat().st_size)
    assert sizes[0] < 0.99 * sizes[1]
    run("convert", capture, tmp_path / "b.fba")
    assert (tmp_path / "b.fba").stat().st_size == sizes[0]
    assert (
        "contradict each other"
        in run("encode", capture, "-o", target, "--tolerance", "1cm", "--still", code=2).err
    )
