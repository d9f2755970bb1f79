"""Track a face in a film with MediaPipe, and write its points as a table that `fba encode` reads.

MediaPipe is no part of this project: give it an environment of its own, and the file of its model.

    python3 -m venv tracking
    tracking/bin/pip install mediapipe
    tracking/bin/python track_a_film.py film.mp4 points.csv --model face_landmarker.task
    fba encode points.csv -o face.fba
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

MODEL = "https://storage.googleapis.com/mediapipe-models/face_landmarker/face_landmarker/float16/1/face_landmarker.task"
COUNT = 478
DIGITS = 7


class Frame(NamedTuple):
    """What was found in a frame. time: seconds. faces: lists of points with x, y and z; empty without any."""

    number: int
    time: float
    faces: Sequence[Sequence[Any]]


def main() -> None:
    """Track the film that the command line names."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("film", type=Path)
    parser.add_argument("table", type=Path, help="CSV to write")
    parser.add_argument("--model", type=Path, default=Path("face_landmarker.task"), help="MediaPipe's model")
    parser.add_argument("--faces", type=int, default=1, help="most faces in a frame")
    given = parser.parse_args()
    if not given.model.is_file():
        sys.exit(f"{given.model} is not there; download it from {MODEL}")
    width, height, frames = track(given.film, given.model, given.faces)
    with given.table.open("w", newline="", encoding="utf-8") as file:
        seen, count = write_points(csv.writer(file), width, height, frames)
    if not count:
        sys.exit(f"{given.film} has no frames that can be read")
    print(f"{given.table}: a face in {seen} of {count} frames")


def track(film: Path, model: Path, faces: int) -> tuple[int, int, Iterator[Frame]]:
    """Return width and height of a film, and what is found in its frames, one after another."""
    import cv2
    import mediapipe as mp

    capture = cv2.VideoCapture(str(film))
    width, height = (int(capture.get(one)) for one in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT))
    rate = capture.get(cv2.CAP_PROP_FPS) or 30.0
    vision = mp.tasks.vision
    options = vision.FaceLandmarkerOptions(
        base_options=mp.tasks.BaseOptions(model_asset_path=str(model)),
        running_mode=vision.RunningMode.VIDEO,
        num_faces=faces,
    )

    def frames() -> Iterator[Frame]:
        with vision.FaceLandmarker.create_from_options(options) as landmarker:
            number, last = 0, -1
            while True:
                there, picture = capture.read()
                if not there:
                    return
                shown = capture.get(cv2.CAP_PROP_POS_MSEC) or 1000 * number / rate
                stamp = max(round(shown), last + 1)  # MediaPipe wants times that rise, in whole milliseconds
                image = mp.Image(mp.ImageFormat.SRGB, cv2.cvtColor(picture, cv2.COLOR_BGR2RGB))
                yield Frame(number, shown / 1000, landmarker.detect_for_video(image, stamp).face_landmarks)
                number, last = number + 1, stamp

    return width, height, frames()


def write_points(table: Any, width: int, height: int, frames: Iterable[Frame]) -> tuple[int, int]:
    """Write a row for each face, and one for a frame without; return how many frames have faces, and are.

    table: a writer of `csv`. width, height: of the picture, of which x and y are shares.
    """
    points = [f"{axis}_{point}" for point in range(COUNT) for axis in "xyz"]
    table.writerow(["frame", "timestamp", "face_id", "width", "height", *points])
    seen = count = 0
    for frame in frames:
        count += 1
        seen += bool(frame.faces)
        for face, found in enumerate(frame.faces or [()]):
            cells = [round(value, DIGITS) for point in found for value in (point.x, point.y, point.z)]
            cells = cells or [""] * (3 * COUNT)
            name = face if frame.faces else ""
            table.writerow([frame.number, round(frame.time, 6), name, width, height, *cells])
    return seen, count


if __name__ == "__main__":
    main()
