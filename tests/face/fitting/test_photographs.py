"""Photographs are read upright and small; what is no photograph of a face is refused."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fba import Limits
from fba.errors import FbaWarning, FormatError, LimitError, ModelError
from fba.face.fitting import read_photograph


def picture(width: int, height: int) -> Image.Image:
    across = np.linspace(0, 255, width)[None, :, None] * np.array([1.0, 0.3, 0.1])
    return Image.fromarray(np.broadcast_to(across, (height, width, 3)).astype(np.uint8))


def test_a_photograph_is_turned_upright_as_exif_says(tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[0x0112] = 6  # to be turned clockwise by a quarter
    picture(200, 100).save(tmp_path / "a.jpg", exif=exif, quality=95)
    read = read_photograph(tmp_path / "a.jpg")
    assert read.size == (100, 200)
    assert read.pixels.shape == (200, 100, 3)
    assert read.pixels[10, 50, 0] < 60  # what was left is up
    assert read.pixels[190, 50, 0] > 200


def test_large_photographs_are_kept_small(tmp_path: Path) -> None:
    """A picture of 50 megapixels is read, and no more of it kept than a skin needs."""
    Image.new("RGB", (8660, 5774), (200, 150, 120)).save(tmp_path / "a.jpg", quality=50)
    read = read_photograph(tmp_path / "a.jpg")
    assert read.size == (8660, 5774)
    assert max(read.pixels.shape) <= 2048
    assert read.scale == pytest.approx(8660 / read.pixels.shape[1])
    with pytest.raises(LimitError, match="pixels"):
        read_photograph(tmp_path / "a.jpg", limits=Limits(pixels=1_000_000))


def test_a_grey_photograph_is_told(tmp_path: Path) -> None:
    picture(100, 100).convert("L").save(tmp_path / "a.png")
    with pytest.warns(FbaWarning, match="no colours"):
        assert read_photograph(tmp_path / "a.png").pixels.shape == (100, 100, 3)


def test_alpha_and_palettes_are_read(tmp_path: Path) -> None:
    picture(100, 100).convert("RGBA").save(tmp_path / "a.png")
    picture(100, 100).convert("P").save(tmp_path / "b.png")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for name in ("a.png", "b.png"):
            assert read_photograph(tmp_path / name).pixels.shape == (100, 100, 3)


def test_what_is_no_photograph_is_refused(tmp_path: Path) -> None:
    picture(1, 1).save(tmp_path / "tiny.png")
    with pytest.raises(ModelError, match="1 x 1 pixels"):
        read_photograph(tmp_path / "tiny.png")
    picture(300, 300).save(tmp_path / "whole.png")
    (tmp_path / "half.png").write_bytes((tmp_path / "whole.png").read_bytes()[:200])
    (tmp_path / "text.jpg").write_text("no picture")
    Image.new("I;16", (100, 100)).save(tmp_path / "deep.png")
    for name in ("half.png", "text.jpg", "deep.png", "missing.jpg"):
        with pytest.raises(FormatError):
            read_photograph(tmp_path / name)
