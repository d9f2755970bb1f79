"""The same motion as samples of a glTF animation, plain and packed by meshopt, both under zstd.

EXT_meshopt_compression packs any buffer view, also of animations, as gltfpack and glTF-Transform use it.
Draco packs meshes only. Counted are the bytes of samples and their times, not the JSON that names them.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from bench.bitrate.packages import find_package, find_zstd
from bench.bitrate.subjects import BODY, Subject
from fba.arrays import Array, Float64, Int64
from fba.body import BapSolver

SMALLEST_TURN = 1e-7
"""A joint whose quaternion changes by less is not animated."""
ROW_MAX = 256
"""Bytes of a row that meshopt packs at most."""


def gltf_rates(subject: Subject, values: Int64 | Float64) -> dict[str, int]:
    """Return bytes by the name of the form; without those whose packages are missing.

    values: (T, 68) FAPs as weights of morph targets, or (T, 296) BAPs, which become rotations.
    """
    zstd = find_zstd()
    if zstd is None:
        return {}
    times = subject.animation.times.astype("<f4")
    if subject.kind == BODY:
        turns, root = _rotations(values)
        plain = [times, *turns.transpose(1, 0, 2).astype("<f4"), root.astype("<f4")]
    else:
        moving = np.asarray(values, dtype=np.float64)[:, np.asarray(values).any(axis=0)]
        plain = [times, moving.astype("<f4")]
    found = {
        "glTF, float32, zstd 19": _zstd_size(zstd, [np.ascontiguousarray(one).tobytes() for one in plain])
    }
    meshopt = find_package("meshopt")
    if meshopt is None:
        return found
    packed = [meshopt.encode_gltf_buffer(times[:, None], "ATTRIBUTES")]
    if subject.kind == BODY:
        for turn in turns.transpose(1, 0, 2):
            rows = meshopt.encode_filter_quat(np.ascontiguousarray(turn, dtype=np.float32), 8, 16)
            packed.append(meshopt.encode_gltf_buffer(rows, "ATTRIBUTES"))
        packed.append(
            meshopt.encode_gltf_buffer(meshopt.encode_filter_exp(root.astype(np.float32), 15), "ATTRIBUTES")
        )
    else:
        packed += [meshopt.encode_gltf_buffer(rows, "ATTRIBUTES") for rows in _int16_rows(moving)]
    found["glTF, int16, meshopt, zstd 19"] = _zstd_size(zstd, packed)
    return found


def _zstd_size(zstd: object, parts: list[bytes]) -> int:
    return len(zstd.ZstdCompressor(level=19).compress(b"".join(parts)))  # type: ignore[attr-defined]


def _int16_rows(values: Float64) -> list[Array]:
    """Return values (T, N) as int16 rows of a multiple of four bytes, as wide as meshopt takes them."""
    width = ROW_MAX // 2
    pieces = [values[:, start : start + width] for start in range(0, values.shape[1], width)]
    return [np.ascontiguousarray(np.pad(one, ((0, 0), (0, one.shape[1] % 2))), dtype="<i2") for one in pieces]


@cache
def _solver() -> BapSolver:
    return BapSolver()


def _rotations(baps: Int64 | Float64) -> tuple[Float64, Float64]:
    """Return quaternions of the joints that move within their parents, float64 (T, J, 4), and the root's
    position (T, 3), metres."""
    from scipy.spatial.transform import Rotation

    solver = _solver()
    matrices = solver.pose(np.asarray(baps))
    rotations = matrices[..., :3, :3]
    parents = solver.skeleton.parents
    local = rotations.copy()
    local[:, 1:] = np.einsum("tjba,tjbc->tjac", rotations[:, parents[1:]], rotations[:, 1:])
    quaternions = Rotation.from_matrix(local.reshape(-1, 3, 3)).as_quat().reshape(*local.shape[:2], 4)
    quaternions *= np.where(quaternions[..., 3:] < 0, -1.0, 1.0)
    moves = np.abs(quaternions - quaternions[:1]).max(axis=(0, 2)) > SMALLEST_TURN
    return quaternions[:, moves], matrices[:, 0, :3, 3]
