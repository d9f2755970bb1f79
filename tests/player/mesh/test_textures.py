"""Pictures on faces: their sizes, what is seen of them, and what is kept of them."""

import io
from pathlib import Path

import numpy as np
import pytest

Image = pytest.importorskip("PIL.Image")

from fba_player._mesh.textures import MIN_CACHED_BYTES, load_picture  # noqa: E402 - needs Pillow


def encoded(pixels: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, "PNG")
    return buffer.getvalue()


def test_reduced_pictures_hold_square_roots_of_light() -> None:
    grey = load_picture(encoded(np.full((5, 8, 3), 128, dtype=np.uint8)))
    assert (grey.size, grey.opaque) == ((8, 5), True)
    half = grey.reduced(2)
    assert half.shape == (3, 4, 4)
    # sRGB 128 is 0.2159 of the light: its root is 0.4646 of 255
    assert (np.unique(half[..., :3]).tolist(), np.unique(half[..., 3]).tolist()) == ([118], [255])


def test_one_clear_texel_is_enough() -> None:
    pixels = np.full((4, 4, 4), 255, dtype=np.uint8)
    pixels[1, 2, 3] = 254
    assert not load_picture(encoded(pixels)).opaque


def test_a_large_picture_is_decoded_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FBA_CACHE", str(tmp_path))
    noise = np.random.default_rng(5).integers(0, 256, (300, 200, 3), dtype=np.uint8)
    data = encoded(noise)
    assert len(data) > MIN_CACHED_BYTES
    first = load_picture(data)
    seen = first.reduced(4)

    def fails(data: bytes) -> None:
        raise AssertionError("decoded again")

    monkeypatch.setattr("fba_player._mesh.textures._decode", fails)
    again = load_picture(data)
    assert (again.size, again.opaque) == (first.size, first.opaque) == ((200, 300), True)
    np.testing.assert_array_equal(again.reduced(4), seen)
    with pytest.raises(AssertionError, match="decoded again"):
        again.reduced(2)
