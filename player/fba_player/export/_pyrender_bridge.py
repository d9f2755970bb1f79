"""A pose as a pyrender scene: for programs built on pyrender, and to compare our pictures with.

pyrender is an extra: `pip install ".[pyrender]"` in the checkout, or `pip install pyrender`. Its last release
was made for NumPy 1: while a scene is built, the names that NumPy 2 dropped are added, and removed
afterwards.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

from fba.animation import Animation
from fba.arrays import Float32, Float64, Int32
from fba.choices import Axes
from fba.errors import DisplayError
from fba.rotations import unit
from fba_player._mesh.primitives import sphere_mesh
from fba_player.export._offscreen import follow_camera, looks_at_head
from fba_player.gl._context import missing_libraries, missing_text
from fba_player.scene.scene import Scene
from fba_player.view._camera import Camera
from fba_player.view._geometry import transform, turn_partly
from fba_player.view._view import Eye, FaceMesh, Mesh

if TYPE_CHECKING:
    from fba.body import BodyModel
    from fba.face import FaceModel


NUMPY_1 = {"infty": np.inf, "Inf": np.inf, "NaN": np.nan, "float_": np.float64}
"""Names that NumPy 2 has dropped and that pyrender, or trimesh, may use."""
WHITE = (0.62, 0.58, 0.55)
PUPIL = (0.004, 0.004, 0.004)
"""Linear colours of an eye."""
IRIS_LIGHT = 2.2
"""Factor on the colour of the iris, which is that under the cornea: the cornea gathers light on it."""
WET = 0.15
"""Roughness of a wet eye."""
EXPOSURE = 0.72
"""Factor on all lights: unlike ours, pyrender's pictures have no tone mapping."""
EYE_ROWS = 64
EYE_AROUND = 48
"""Vertices of an eyeball from pole to pole, and around."""


def to_pyrender(
    model: FaceModel | None,
    animation: Animation,
    t: float = 0.0,
    *,
    camera: Camera | str | None = None,
    aspect: float = 16 / 9,
    body: BodyModel | None = None,
    axes: Axes = "iso",
) -> Any:
    """Return a `pyrender.Scene` of an animation at t seconds: its meshes, our camera and the studio's lights.

    model: the face; None for the built-in head. camera: a `Camera`, the name of a preset, or None for the one
    that suits the content; aspect: width / height of the picture. body, axes: as in `Scene`. Units are
    metres, y up, the person looking along +z.

    Without a display, set PYOPENGL_PLATFORM=egl before pyrender is imported, and draw the scene with
    `pyrender.OffscreenRenderer(width, height).render(scene)`.

    Raises DisplayError if pyrender cannot be imported, and the errors of `Scene`.
    """
    with _numpy_1_names():
        pyrender = _import_pyrender()
        shown = Scene(animation, model, body=body, axes=axes)
        view = shown.view_at(t)
        eye = camera if isinstance(camera, Camera) else shown.camera(camera, aspect)
        scene = pyrender.Scene(bg_color=(0.5, 0.5, 0.5, 0.0), ambient_light=_ambient())
        for face in view.faces:
            _add(pyrender, scene, face.shape.name or face.shape.kind, *_face_primitive(pyrender, face))
        for mesh in view.meshes:
            _add(pyrender, scene, "mesh", *_mesh_primitive(pyrender, mesh))
        for number, ball in enumerate(view.eyes):
            _add(pyrender, scene, ("left eye", "right eye")[number % 2], *_eye_primitive(pyrender, ball))
        _add_camera(pyrender, scene, follow_camera(eye, shown, t, of_head=looks_at_head(camera)), aspect)
        _add_lights(pyrender, scene)
        return scene


def _import_pyrender() -> Any:
    try:
        import pyrender
    except Exception as error:  # PyOpenGL raises errors of its own where OpenGL is missing
        missing = missing_libraries()
        if missing:
            raise DisplayError(f"pyrender needs OpenGL, but {missing_text(missing)}") from error
        raise DisplayError(
            f"pyrender cannot be imported: {error}. Install it with: pip install pyrender; without a "
            "display, set PYOPENGL_PLATFORM=egl first"
        ) from error
    return pyrender


@contextmanager
def _numpy_1_names() -> Iterator[None]:
    added = [name for name in NUMPY_1 if name not in vars(np)]
    for name in added:
        setattr(np, name, NUMPY_1[name])
    try:
        yield
    finally:
        for name in added:
            delattr(np, name)


def _add(pyrender: Any, scene: Any, name: str, attributes: dict[str, Any], material: Any) -> None:
    primitive = pyrender.Primitive(material=material, mode=4, **attributes)
    mesh = pyrender.Mesh([primitive], name=name)
    mesh.bounds  # noqa: B018 - computed and cached now, while the names of NumPy 1 are there
    scene.add(mesh, name=name)


def _face_primitive(pyrender: Any, face: FaceMesh) -> tuple[dict[str, Any], Any]:
    shape = face.shape
    positions = turn_partly(face.positions, shape.sway, face.turn, face.centre)
    normals = turn_partly(face.normals, shape.sway, face.turn, np.zeros(3))
    attributes = _world_attributes(positions, normals, face.matrix, shape.triangles, shape.colours)
    texture = None
    if shape.picture is not None and shape.texcoords is not None:
        texture = pyrender.Texture(source=shape.picture.pixels, source_channels="RGBA")
        attributes["texcoord_0"] = np.stack([shape.texcoords[:, 0], 1 - shape.texcoords[:, 1]], axis=1)
    return attributes, _material(
        pyrender, _roughness(shape.colours), baseColorTexture=texture,
        alphaMode="BLEND" if shape.see_through else "OPAQUE", doubleSided=not shape.closed,
    )  # fmt: skip


def _mesh_primitive(pyrender: Any, mesh: Mesh) -> tuple[dict[str, Any], Any]:
    shape = mesh.shape
    attributes = _world_attributes(mesh.positions, mesh.normals, mesh.matrix, shape.triangles, shape.colours)
    return attributes, _material(pyrender, _roughness(shape.colours))


def _eye_primitive(pyrender: Any, ball: Eye) -> tuple[dict[str, Any], Any]:
    points, triangles = sphere_mesh(EYE_ROWS, EYE_AROUND)
    across = np.hypot(points[:, 0], points[:, 1])
    front = points[:, 2] > 0
    colours = np.tile(np.array([*WHITE, 1.0], dtype=np.float32), (len(points), 1))
    colours[front & (across < ball.iris), :3] = np.array(ball.tint) * IRIS_LIGHT
    colours[front & (across < ball.pupil), :3] = PUPIL
    attributes = _world_attributes(points, points, ball.matrix, triangles, colours)
    return attributes, _material(pyrender, WET)


def _material(pyrender: Any, roughness: float, **more: Any) -> Any:
    options = {"metallicFactor": 0.0, "roughnessFactor": roughness, "doubleSided": True, **more}
    return pyrender.MetallicRoughnessMaterial(**options)


def _world_attributes(
    positions: Float32 | Float64,
    normals: Float32 | Float64,
    matrix: Float64,
    triangles: Int32,
    colours: Float32,
) -> dict[str, Any]:
    """Return the attributes of a pyrender primitive in world coordinates."""
    opaque = np.ones((len(colours), 1))
    return {
        "positions": transform(positions, matrix).astype(np.float32),
        "normals": unit(normals @ matrix[:3, :3].T).astype(np.float32),
        "indices": np.ascontiguousarray(triangles, dtype=np.uint32),
        "color_0": np.hstack([colours[:, :3], opaque]).astype(np.float32),
    }


def _roughness(colours: Float32) -> float:
    """Return one roughness for a mesh; the fourth channel of its colours is the gloss of each vertex."""
    return float(np.clip(1 - np.median(colours[:, 3]), 0.12, 1.0)) if len(colours) else 1.0


def _add_camera(pyrender: Any, scene: Any, camera: Camera, aspect: float) -> None:
    matrix = camera.projection_matrix(aspect)
    near = matrix[2, 3] / (matrix[2, 2] - 1)  # from the projection matrix of OpenGL
    far = matrix[2, 3] / (matrix[2, 2] + 1)
    lens = pyrender.PerspectiveCamera(
        yfov=math.radians(camera.field_of_view), znear=near, zfar=far, aspectRatio=aspect
    )
    node = scene.add(lens, name="camera", pose=np.linalg.inv(camera.view_matrix()))
    scene.main_camera_node = node


def _add_lights(pyrender: Any, scene: Any) -> None:
    lights = _studio()
    for name in ("KEY", "FILL", "RIM"):
        colour, direction = lights[name], lights[f"{name}_DIRECTION"]
        bright = float(colour.max())
        # Our surfaces reflect colour x light, those of pyrender the same divided by pi.
        light = pyrender.DirectionalLight(color=colour / bright, intensity=bright * math.pi * EXPOSURE)
        scene.add(light, name=f"{name.lower()} light", pose=_shining_from(direction))


def _ambient() -> Float64:
    lights = _studio()
    return np.asarray((lights["SKY"] + lights["FLOOR"]) / 2 * EXPOSURE)


def _studio() -> dict[str, Float64]:
    """Return the studio's lights as the shaders define them: linear colours and directions by name."""
    text = (files("fba_player.gl") / "shaders" / "lighting.glsl").read_text(encoding="utf-8")
    constants = re.findall(r"const vec3 ([A-Z_]+) = (?:normalize\()?vec3\(([^)]*)\)", text)
    return {name: np.array(values.split(","), dtype=np.float64) for name, values in constants}


def _shining_from(direction: Float64) -> Float64:
    """Return the pose (4, 4) of a light that shines along its -z, from a direction onto the origin."""
    back = direction / np.linalg.norm(direction)
    right = np.cross([0.0, 1.0, 0.0], back)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([right, np.cross(back, right), back])
    return pose
