"""A head from photographs: points on a frontal picture and a profile, the head that fits, and its skin.

front = Photo(read_photograph("me.jpg"), read_photo_points("me.points.json")["front"])
head_from_photos(front).model.save("me.glb")
"""

from fba.face.fitting._front_points import find_front_points
from fba.face.fitting._head import DISTANCE, Photo, PhotoHead, head_from_photos, template_points
from fba.face.fitting._measures import Measure
from fba.face.fitting._photographs import FoundPoints, Photograph, Step, read_photograph
from fba.face.fitting._points_file import FRONT_POINTS, SIDE_POINTS, read_photo_points, write_photo_points
from fba.face.fitting._side_points import find_side_points

__all__ = [
    "DISTANCE", "FRONT_POINTS", "SIDE_POINTS", "FoundPoints", "Measure", "Photo", "PhotoHead", "Photograph",
    "Step", "find_front_points", "find_side_points", "head_from_photos", "read_photo_points",
    "read_photograph", "template_points", "write_photo_points",
]  # fmt: skip
