"""Functions that make scenes from the meshes of other packages, without importing those."""

from __future__ import annotations

from typing import Any

import numpy as np

from linelit._linelit import Scene


def from_trimesh(mesh: Any, **options: Any) -> Scene:
    """Make a scene of a ``trimesh.Trimesh`` or of all meshes of a ``trimesh.Scene``.

    Parameters
    ----------
    mesh : trimesh.Trimesh or trimesh.Scene
        Transforms of a scene's graph are applied.
    **options
        The keyword arguments of `Scene`.

    Returns
    -------
    Scene

    Raises
    ------
    TypeError
        If the argument has neither vertices and faces nor a method that joins its meshes.
    """
    if hasattr(mesh, "to_mesh"):
        mesh = mesh.to_mesh()
    elif hasattr(mesh, "dump") and not hasattr(mesh, "faces"):
        mesh = mesh.dump(concatenate=True)
    if not hasattr(mesh, "vertices") or not hasattr(mesh, "faces"):
        raise TypeError(f"mesh is {type(mesh)}, and needs to be a trimesh.Trimesh or trimesh.Scene")
    return Scene(np.asarray(mesh.vertices), np.asarray(mesh.faces), **options)


def from_mitsuba(scene: Any, *, emitters: bool = True, **options: Any) -> Scene:
    """Make a scene of the shapes of a ``mitsuba.Scene``, or of one mesh.

    Parameters
    ----------
    scene : mitsuba.Scene, mitsuba.Mesh or a list of meshes
        Shapes need triangles: a shape that is not a mesh is refused, with its number.
    emitters : bool
        Whether shapes that emit cast shadows, too. Use False for shapes that are passed to queries
        as a `Light`: by rounding, their own triangles could hide them.
    **options
        The keyword arguments of `Scene`.

    Returns
    -------
    Scene

    Raises
    ------
    TypeError
        If a shape has no triangles.
    """
    shapes = scene.shapes() if hasattr(scene, "shapes") else scene
    if not isinstance(shapes, (list, tuple)):
        shapes = [shapes]
    all_vertices, all_faces, count = [np.zeros((0, 3), np.float32)], [np.zeros((0, 3), np.uint32)], 0
    for number, shape in enumerate(shapes):
        if not emitters and shape.is_emitter():
            continue
        vertices, faces = _mesh(shape, number)
        all_vertices.append(vertices)
        all_faces.append(faces + np.uint32(count))
        count += len(vertices)
    return Scene(np.concatenate(all_vertices), np.concatenate(all_faces), **options)


def _mesh(shape: Any, number: int) -> tuple[Any, Any]:
    """Return the vertices and faces of a Mitsuba shape."""
    buffers = []
    # Try the names in Mitsuba 3, and names that later versions may use.
    for names in (
        ("vertex_positions_buffer", "vertex_positions", "positions"),
        ("faces_buffer", "faces"),
    ):
        found = [getattr(shape, name) for name in names if hasattr(shape, name)]
        if not found:
            raise TypeError(f"shape {number} is {type(shape)}, which has no triangles")
        buffer = found[0]() if callable(found[0]) else found[0]
        buffers.append(np.asarray(buffer).reshape(-1, 3))
    vertices, faces = buffers
    return vertices.astype(np.float32, copy=False), faces.astype(np.uint32, copy=False)
