"""Figures cut out of pictures: transparent and plain backgrounds, and pictures without a figure."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageDraw, ImageOps

from fba import Limits
from fba.arrays import Bool
from fba.errors import FbaWarning, FormatError, LimitError
from fba.outlines import find_nodes, fit_mask, outline_distances, read_mask
from fba.outlines._index_file import pack_mask, unpack_mask
from fba.outlines._tree import medial_axis

Draw = Callable[..., Path]


@pytest.fixture
def drawn(tmp_path: Path) -> Draw:
    """Write a picture with ellipses on it: boxes (left, top, right, bottom), right and bottom included."""

    def write(
        *boxes: tuple[int, int, int, int], size: tuple[int, int] = (120, 80), mode: str = "RGB",
        paper: object = "white", ink: object = "black", suffix: str = ".png",
    ) -> Path:  # fmt: skip
        image = Image.new(mode, size, paper)  # type: ignore[arg-type]
        for box in boxes:
            ImageDraw.Draw(image).ellipse(box, fill=ink)  # type: ignore[arg-type]
        path = tmp_path / f"picture{suffix}"
        image.save(path)
        return path

    return write


PLAIN = "no figure before a background: it is all of one colour"
BOX = (30, 20, 90, 60)


@pytest.mark.parametrize(
    ("mode", "paper", "ink"),
    [("RGB", "white", "black"), ("RGB", (10, 90, 20), (200, 160, 120)), ("L", 0, 255), ("1", 0, 1),
     ("P", 0, 1), ("RGBA", (255, 0, 0, 0), (255, 0, 0, 255)), ("LA", (0, 0), (0, 255)),
     ("RGBA", (255, 255, 255, 255), (0, 0, 0, 255))],
)  # fmt: skip
def test_a_figure_on_any_background(drawn: Draw, mode: str, paper: object, ink: object) -> None:
    path = drawn(BOX, mode=mode, paper=paper, ink=ink)
    if mode == "P":
        with Image.open(path) as image:
            image.putpalette([0, 0, 0, 255, 255, 255])
            image.save(path)
    expected = np.asarray(Image.open(drawn(BOX, mode="L", paper=0, ink=255, suffix=".bmp"))) > 0
    assert np.array_equal(read_mask(path), expected)


def test_specks_noise_and_lossy_compression_do_not_matter(drawn: Draw) -> None:
    path = drawn(BOX, (2, 2, 6, 6), paper=(200, 205, 210), suffix=".jpg")
    mask, clean = read_mask(path), read_mask(drawn(BOX))
    assert (mask ^ clean).sum() < 0.02 * clean.sum()


@pytest.mark.parametrize(
    ("boxes", "settings", "text"),
    [
        ((), {}, PLAIN),
        ((), {"mode": "RGBA", "paper": (9, 9, 9, 200)}, PLAIN),
        ((), {"mode": "RGBA", "paper": (0, 0, 0, 0)}, PLAIN),
        ((), {"size": (1, 1)}, "no figure before a background"),
        (((0, 0, 20, 20), (60, 30, 80, 50), (90, 0, 100, 40)), {}, "shows 3 figures that do not touch"),
        (((50, 50, 58, 56),), {}, "9 x 7 pixels large; its longer side needs 16"),
    ],
)
def test_pictures_without_a_figure(
    drawn: Draw, boxes: tuple[tuple[int, ...], ...], settings: dict[str, object], text: str
) -> None:
    with pytest.raises(FormatError, match=text) as caught:
        read_mask(drawn(*boxes, **settings))
    assert "picture.png" in str(caught.value)


def test_a_figure_at_the_edge_may_be_cut_off(drawn: Draw) -> None:
    with pytest.warns(FbaWarning, match="reaches the edge of the picture"):
        assert read_mask(drawn((30, 50, 60, 90))).any()


def test_a_background_that_is_not_plain(tmp_path: Path) -> None:
    noise = np.random.default_rng(1).integers(0, 255, (60, 60, 3), dtype=np.uint8)
    Image.fromarray(noise).save(tmp_path / "noise.png")
    with pytest.raises(FormatError, match=r"no plain background: \d+% .* transparent around it"):
        read_mask(tmp_path / "noise.png")


def photograph(light: float = 1.0, shadow: float = 0.0, noise: float = 4.0) -> Image.Image:
    """Return a figure before a wall that is lit from a side, with its shadow on the floor, and noise.

    light: of the darkest corner of the wall, a share. shadow: its darkness. noise: of the camera, levels.
    """
    height, width = 320, 200
    y, x = np.mgrid[:height, :width]
    wall = np.array([186, 178, 160]) * (1 - (1 - light) * ((x + y) / (height + width)) ** 2)[..., None]
    floor = ((x - 130) / 60) ** 2 + ((y - 296) / 8) ** 2 < 1
    wall[floor] *= 1 - shadow
    pixels = Image.fromarray(wall.astype(np.uint8))
    draw = ImageDraw.Draw(pixels)
    draw.ellipse((85, 30, 115, 66), fill=(190, 140, 110))
    draw.rectangle((76, 66, 124, 180), fill=(60, 80, 150))
    for left in (78, 104):
        draw.rectangle((left, 180, left + 18, 300), fill=(50, 45, 40))
    noisy = np.asarray(pixels) + np.random.default_rng(3).normal(0, noise, (height, width, 3))
    return Image.fromarray(np.clip(noisy, 0, 255).astype(np.uint8))


def squared(mask: Bool) -> Bool:
    return unpack_mask(pack_mask(mask))


def saved(picture: Image.Image, path: Path, **settings: Any) -> Path:
    picture.save(path, **settings)
    return path


def turned_by_camera(picture: Image.Image, path: Path) -> Path:
    exif = Image.Exif()
    exif[0x0112] = 6  # the camera was held a quarter to the left
    return saved(picture.rotate(90, expand=True), path, exif=exif)


@pytest.mark.parametrize(
    "vary",
    [
        lambda path: saved(photograph(light=0.55), path),
        lambda path: saved(photograph(shadow=0.4), path),
        lambda path: saved(photograph(light=0.6, shadow=0.35, noise=8), path, quality=40),
        lambda path: saved(photograph().resize((700, 1120)), path),
        lambda path: saved(ImageOps.invert(photograph()), path),
        lambda path: saved(photograph().convert("L"), path),
        lambda path: turned_by_camera(photograph(), path),
    ],
    ids=["light from a side", "shadow", "all of it, compressed", "large", "negative", "grey", "turned"],
)
def test_photographs_before_a_wall(tmp_path: Path, vary: Callable[[Path], Path]) -> None:
    plain = fit_mask(read_mask(saved(photograph(noise=0), tmp_path / "plain.png")))
    mask = fit_mask(read_mask(vary(tmp_path / "picture.jpg")))
    away = float(outline_distances(squared(plain), squared(mask)[None])[0])
    assert away < 0.01


def test_a_few_transparent_pixels_are_no_outline(drawn: Draw) -> None:
    path = drawn(BOX, mode="RGBA", paper=(255, 255, 255, 255), ink=(0, 0, 0, 255))
    with Image.open(path) as image:
        image.putpixel((0, 0), (255, 255, 255, 0))
        image.save(path)
    assert np.array_equal(read_mask(path), read_mask(drawn(BOX, suffix=".bmp")))


def test_large_pictures_are_reduced_or_refused(drawn: Draw) -> None:
    path = drawn((2000, 1000, 6000, 5000), size=(8000, 6250), mode="1", paper=1, ink=0)  # 50 megapixels
    mask = read_mask(path)
    assert max(mask.shape) <= 2048
    assert mask.sum() / mask.size == pytest.approx(np.pi / 4 * 16 / 50, rel=0.01)
    with pytest.raises(LimitError, match="8000 x 6250 pixels"):
        read_mask(path, limits=Limits(pixels=10_000_000))


def test_damaged_pictures(drawn: Draw, tmp_path: Path) -> None:
    whole = drawn(BOX, suffix=".png").read_bytes()
    path = tmp_path / "cut.png"
    for data in (b"not a picture", whole[: len(whole) // 2], whole[:30]):
        path.write_bytes(data)
        with pytest.raises(FormatError, match="cannot be read as a picture"):
            read_mask(path)
    path.write_bytes(b"")
    with pytest.raises(FormatError, match="is empty"):
        read_mask(path)
    with pytest.raises(FormatError, match="no such file"):
        read_mask(tmp_path / "none.png")


def test_a_mask_is_cut_and_scaled() -> None:
    mask = np.zeros((500, 300), dtype=bool)
    mask[100:292, 50:146] = True
    assert fit_mask(mask).shape == (96 + 4, 48 + 4)
    assert fit_mask(mask)[2:-2, 2:-2].all()
    assert fit_mask(mask[100:292, 50:146][::8, ::8]).shape == (100, 52)
    with pytest.raises(FormatError, match="the outline is empty"):
        fit_mask(np.zeros((5, 5), dtype=bool))


def test_the_medial_axis_of_a_bar_is_its_middle_line() -> None:
    mask = np.zeros((25, 104), dtype=bool)
    mask[2:23, 2:102] = True
    points, radii = medial_axis(mask)
    middle = np.abs(points[:, 0] - 51.5) < 38
    assert (np.abs(points[middle, 1] + 12) <= 1).all()
    assert (radii[middle] >= 10).all()
    assert np.ptp(points[middle, 0]) > 70
    corners = points[~middle]
    assert (
        np.abs(np.abs(corners[:, 0] - 51.5) - (49.5 - np.abs(10 - np.abs(corners[:, 1] + 12)))) < 12
    ).all()


def test_the_medial_axis_of_a_disc_is_its_centre() -> None:
    y, x = np.mgrid[:101, :101]
    nodes = find_nodes(np.hypot(x - 50, y - 50) < 45)
    heaviest = nodes.masses.argmax()
    assert nodes.points[heaviest] == pytest.approx([50, -50], abs=2.5)
    assert nodes.radii[heaviest] == pytest.approx(45, abs=2.5)
    with pytest.raises(FormatError, match="the outline is empty"):
        find_nodes(np.zeros((10, 10), dtype=bool))
