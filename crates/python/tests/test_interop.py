"""Meshes of trimesh and Mitsuba, and of classes that look like theirs."""

import types

import linelit as ll
import numpy as np
import pytest

# A triangle that hides all of the lamp with x > 0 from the origin, as in `Scene.visible_fraction`.
VERTICES = np.array([[0, -6, 1], [12, 0, 1], [0, 6, 1]], np.float32)
FACES = np.array([[0, 1, 2]], np.uint32)
MIRRORED = VERTICES * np.array([-1, 1, 1], np.float32)
LAMP = ll.Rectangle([-1, -1, 2], [0, 2, 0], [2, 0, 0], radiance=1.0)


def seen(scene):
    return float(scene.visible_fraction([0, 0, 0], LAMP))


NAMES = [
    ("vertex_positions_buffer", "faces_buffer"),
    ("vertex_positions", "faces"),
    ("positions", "faces"),
]


def stand_in(names=NAMES[0], vertices=VERTICES, emits=False):
    """An object with the attributes of a mesh that have these names; buffers are methods."""
    shape = types.SimpleNamespace(is_emitter=lambda: emits)
    for name in names:
        values = (FACES if name.startswith("faces") else vertices).ravel()
        setattr(shape, name, (lambda x=values: x) if name.endswith("_buffer") else values)
    return shape


@pytest.mark.parametrize("names", NAMES)
def test_meshes_are_read_by_each_name_of_their_buffers(names):
    assert seen(ll.from_mitsuba(stand_in(names))) == 0.5


def test_faces_of_a_list_name_vertices_of_their_own_mesh():
    # Each mesh hides a half of the lamp. If the faces were not renumbered, the first mesh would be
    # read twice and the second would be missing.
    both = [stand_in(), stand_in(NAMES[1], MIRRORED)]
    assert seen(ll.from_mitsuba(both)) == 0.0
    assert seen(ll.from_mitsuba(types.SimpleNamespace(shapes=lambda: both))) == 0.0
    assert ll.from_mitsuba([]).face_count == 0


def test_shapes_that_emit_may_be_left_out():
    shapes = [stand_in(), stand_in(NAMES[0], MIRRORED, emits=True)]
    assert seen(ll.from_mitsuba(shapes)) == 0.0
    assert seen(ll.from_mitsuba(shapes, emitters=False)) == 0.5


@pytest.mark.parametrize("names", [[], ["positions"], ["faces"]])
def test_a_shape_without_triangles_is_refused_by_its_number(names):
    with pytest.raises(TypeError, match="shape 1 .* no triangles"):
        ll.from_mitsuba([stand_in(), stand_in(names)])
    with pytest.raises(TypeError, match="trimesh"):
        ll.from_trimesh(types.SimpleNamespace(vertices=VERTICES))


def test_meshes_of_trimesh():
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.Trimesh(VERTICES, FACES)
    assert seen(ll.from_trimesh(mesh)) == 0.5
    # The second copy is mirrored by its transform.
    scene = trimesh.Scene([mesh])
    scene.add_geometry(mesh, transform=np.diag([-1.0, 1.0, 1.0, 1.0]))
    assert ll.from_trimesh(scene).face_count == 2
    assert seen(ll.from_trimesh(scene)) == 0.0
    with pytest.raises(TypeError, match="PointCloud"):
        ll.from_trimesh(trimesh.PointCloud(VERTICES))


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_rgb"])
def test_scenes_of_mitsuba(variant):
    mitsuba = pytest.importorskip("mitsuba")
    try:
        mitsuba.set_variant(variant)
        mesh = mitsuba.Mesh("triangle", 3, 1)
    except (AttributeError, ImportError, RuntimeError) as error:
        pytest.skip(f"{variant} does not run: {error}")
    parameters = mitsuba.traverse(mesh)
    parameters["vertex_positions"] = VERTICES.ravel()
    parameters["faces"] = FACES.ravel()
    parameters.update()
    mirror = mitsuba.ScalarTransform4f().scale([-1, 1, 1]).translate([2, 0, 1])
    light = {"type": "area", "radiance": {"type": "rgb", "value": 1.0}}
    other = {"type": "rectangle", "to_world": mirror.scale(2), "emitter": light}
    scene = mitsuba.load_dict({"type": "scene", "a": mesh, "b": other})
    assert seen(ll.from_mitsuba(mesh)) == 0.5
    assert seen(ll.from_mitsuba(scene)) == 0.0
    assert seen(ll.from_mitsuba(scene, emitters=False)) == 0.5
    with pytest.raises(TypeError, match="shape 0 .* no triangles"):
        ll.from_mitsuba(mitsuba.load_dict({"type": "sphere"}))
