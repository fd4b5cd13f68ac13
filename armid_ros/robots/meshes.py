# Copyright 2026 The armid_ros developers
# SPDX-License-Identifier: Apache-2.0
"""
Replacement of collision meshes by a few convex bodies.

A distance between convex bodies takes microseconds, and a distance between meshes milliseconds.
However, the hull of a forearm with a housing at each end fills the gap between them, and would
collide with a wrist there. A mesh is therefore cut into slabs across its best axis. Each slab is
replaced by its hull; neighbours are merged while their common hull is not much larger. The bodies
contain the whole mesh, so a clearance is never overestimated.

"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from armid_ros.errors import RobotError
from armid_ros.files import is_file
from armid_ros.motion import FloatArray
from armid_ros.robots.xacro_expansion import package_folders
import coal
import numpy as np
import numpy.typing as npt

#: Largest ratio of the volume of a hull to the volume that it replaces.
_MAX_VOLUME_RATIO = 1.1
_QHULL_ERRORS = (RuntimeError, ValueError)  # errors that qhull raises for degenerate points
#: Function from a package and the file of the description to possible folders of the package.
Folders = Callable[[str, Path | None], Iterable[Path]]


def find_mesh(name: str, urdf: Path | None, folders: Folders = package_folders) -> Path | None:
    """
    Return the path of a mesh file that a URDF names; None if the file is not found.

    'package://NAME/...' is searched in the `package_folders`. A relative path starts at the
    folder of the URDF.

    """
    if name.startswith('package://'):
        package, _, inside = name.removeprefix('package://').lstrip('/').partition('/')
        candidates = [folder / inside for folder in folders(package, urdf)]
    else:
        folder = Path() if urdf is None else urdf.resolve().parent
        candidates = [folder / name.removeprefix('file://')]
    return next((path for path in candidates if is_file(path)), None)


def load_mesh(path: Path, scale: FloatArray) -> Any:
    """Load a mesh file as a scaled mesh of the library coal; RobotError if it is no mesh."""
    try:
        return coal.MeshLoader().load(str(path), scale)
    except (RuntimeError, ValueError) as error:
        raise RobotError(f'{path}: cannot be read as a mesh: {error}') from None


def convex_bodies(path: Path, scale: FloatArray) -> tuple[coal.CollisionGeometry, ...]:
    """
    Return convex bodies that tightly enclose a mesh; a flat mesh gives one body.

    Parameters
    ----------
    path : Path
        A mesh file of a format that assimp reads.
    scale : ndarray, shape (3,)
        Factors along the axes of the file.

    Raises
    ------
    RobotError
        If the file is not a mesh.

    """
    mesh = load_mesh(path, scale)
    vertices = np.array(mesh.vertices())
    try:
        whole = _hull(vertices)
    except _QHULL_ERRORS:
        return (mesh,)
    if whole.computeVolume() < _MAX_VOLUME_RATIO * abs(mesh.computeVolume()):
        return (whole,)
    faces = [mesh.tri_indices(number) for number in range(mesh.num_tris)]
    corners = np.array([(face[0], face[1], face[2]) for face in faces])
    sides = np.sort(np.vstack([corners[:, (0, 1)], corners[:, (1, 2)], corners[:, (2, 0)]]))
    edges = np.unique(sides[:, 0] * len(vertices) + sides[:, 1])
    ends = np.column_stack(np.divmod(edges, len(vertices)))
    _, axes = np.linalg.eigh(np.cov(np.array(whole.points()).T))
    best = min((_slabs(vertices, ends, axis) for axis in axes.T), key=_volume)
    bodies = _join(best)
    return bodies if _volume(bodies) * _MAX_VOLUME_RATIO < whole.computeVolume() else (whole,)


def _slabs(
    vertices: FloatArray, ends: npt.NDArray[np.intp], axis: FloatArray
) -> tuple[coal.ConvexBase, ...]:
    """Cut a mesh across an axis into slabs; return the convex hull of each slab."""
    along = vertices @ axis
    start, end = along[ends[:, 0]], along[ends[:, 1]]
    hulls: list[coal.ConvexBase] = []
    thin = np.empty((0, 3))
    for low, high in pairwise(np.linspace(along.min(), along.max(), 13)):  # twelve slabs
        pieces = [thin, vertices[(along >= low) & (along <= high)]]
        for plane in (low, high):  # points where edges of the mesh cross the planes of the slab
            crosses = (start - plane) * (end - plane) < 0.0
            share = ((plane - start[crosses]) / (end[crosses] - start[crosses]))[:, None]
            first, second = vertices[ends[crosses, 0]], vertices[ends[crosses, 1]]
            pieces.append((1.0 - share) * first + share * second)
        points = np.vstack(pieces)
        try:
            hulls.append(_hull(points))
            thin = np.empty((0, 3))
        except _QHULL_ERRORS:  # a flat slab becomes part of the next one
            thin = points
    if len(thin) > 0:
        hulls.append(_hull(np.vstack([hulls.pop().points(), thin])))
    return tuple(hulls)


def _join(slabs: Sequence[coal.ConvexBase]) -> tuple[coal.ConvexBase, ...]:
    """Merge neighbouring hulls, first the pair whose common hull adds the least volume."""
    bodies = list(slabs)
    apart = [body.computeVolume() for body in bodies]
    common = [_common_hull(*pair) for pair in pairwise(bodies)]
    while common:
        growth = [
            body.computeVolume() / sum(volumes)
            for body, volumes in zip(common, pairwise(apart), strict=True)
        ]
        tightest = int(np.argmin(growth))
        if growth[tightest] > _MAX_VOLUME_RATIO:
            break
        bodies[tightest : tightest + 2] = [common[tightest]]
        apart[tightest : tightest + 2] = [sum(apart[tightest : tightest + 2])]
        around = bodies[max(tightest - 1, 0) : tightest + 2]
        common[max(tightest - 1, 0) : tightest + 2] = [
            _common_hull(*pair) for pair in pairwise(around)
        ]
    return tuple(bodies)


def _common_hull(first: coal.ConvexBase, second: coal.ConvexBase) -> coal.ConvexBase:
    return _hull(np.vstack([first.points(), second.points()]))


def _volume(bodies: Sequence[coal.ConvexBase]) -> float:
    return sum(float(body.computeVolume()) for body in bodies)


def _hull(points: FloatArray) -> coal.ConvexBase:
    """Return the convex hull of points (k, 3); ValueError for coplanar points."""
    if len(points) < 4:
        raise ValueError('a convex hull needs at least four points')
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if spread[2] < 1e-5 * spread[0]:
        raise ValueError('a convex hull needs points that do not lie in one plane')
    corners = coal.StdVec_Vec3s()
    corners.extend(list(points))
    return coal.Convex.convexHull(corners, True, 'Qt')
