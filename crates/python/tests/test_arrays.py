"""Arrays of all types and layouts give the same answers, and are left as they are."""

import subprocess
import sys

import linelit as ll
import numpy as np
import pytest

RNG = np.random.default_rng(5)
VERTICES = RNG.uniform(-1, 1, (30, 3)).astype(np.float32) * [1, 1, 0.3] + [0, 0, 1]
FACES = np.arange(30).reshape(-1, 3)
SCENE = ll.Scene(VERTICES, FACES)
LAMP = ll.Rectangle([-1, -1, 2], [0, 2, 0], [2, 0, 0], 3.0)
# Multiples of 1/8 are exact in every type.
POINTS = (RNG.integers(-8, 9, (40, 3)) / 8) * [1, 1, 0]
NORMALS = RNG.integers(-1, 2, (40, 3)) + [0, 0, 2]
WANT = SCENE.irradiance(POINTS, NORMALS.astype(float), LAMP, method="exact")


def read_only(array):
    array = array.copy()
    array.flags.writeable = False
    return array


def unaligned(array):
    raw = np.zeros(array.nbytes + 1, np.uint8)
    moved = raw[1:].view(array.dtype).reshape(array.shape)
    moved[...] = array
    return moved


def in_steps(array):
    wide = np.full((len(array), 6), 7, array.dtype)
    wide[:, ::2] = array
    return wide[:, ::2]


LAYOUTS = {
    "as it is": np.asarray,
    "Fortran": np.asfortranarray,
    "backwards": lambda a: a[::-1].copy()[::-1],
    "read-only": read_only,
    "unaligned": unaligned,
    "in steps": in_steps,
    "a list": lambda a: a.tolist(),
    "a subclass": lambda a: a.view(type("Mine", (np.ndarray,), {})),
}


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("dtype", ["f8", "f4", "f2", "g", ">f8", ">f4"])
def test_points_of_any_type_and_layout(dtype, layout):
    points = LAYOUTS[layout](POINTS.astype(dtype))
    before = np.array(points)
    got = SCENE.irradiance(points, NORMALS, LAMP, method="exact")
    assert np.array_equal(got, WANT)
    assert np.array_equal(np.array(points), before)


@pytest.mark.parametrize("dtype", ["i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", ">i4", ">u4"])
@pytest.mark.parametrize("layout", LAYOUTS)
def test_faces_of_any_type_and_layout(dtype, layout):
    scene = ll.Scene(VERTICES, LAYOUTS[layout](FACES.astype(dtype)))
    assert scene.face_count == 10
    assert np.array_equal(scene.irradiance(POINTS, NORMALS, LAMP, method="exact"), WANT)


def test_integers_are_numbers():
    assert ll.Polygon([[0, 0, 2], [0, 1, 2], [1, 0, 2]], 1).power == pytest.approx(np.pi / 2)
    assert SCENE.irradiance([0, 0, 0], [0, 0, 1], LAMP).shape == ()


def test_shapes_are_kept():
    points = POINTS.reshape(5, 2, 4, 3)
    normals = NORMALS.reshape(5, 2, 4, 3)
    assert np.array_equal(SCENE.irradiance(points, normals, LAMP, method="exact"), WANT.reshape(5, 2, 4))
    colour = ll.Rectangle([-1, -1, 2], [0, 2, 0], [2, 0, 0], [3.0, 0.0, 6.0])
    got = SCENE.irradiance(points, normals, colour, method="exact")
    assert got.shape == (5, 2, 4, 3)
    assert np.array_equal(got[..., 0], WANT.reshape(5, 2, 4)) and not got[..., 1].any()
    assert SCENE.visible_fraction(points, LAMP).shape == (5, 2, 4)
    one = SCENE.irradiance(POINTS[0], NORMALS[0], LAMP, method="exact")
    assert isinstance(one, np.float64) and one == WANT[0]


def test_empty_arrays_give_empty_arrays():
    none = np.zeros((0, 3))
    assert SCENE.irradiance(none, none, LAMP).shape == (0,)
    assert SCENE.irradiance(np.zeros((3, 0, 3)), [0, 0, 1], LAMP).shape == (3, 0)
    assert SCENE.visible_fraction(none, LAMP).shape == (0,)
    lo, hi, offsets = SCENE.visible_intervals(none, np.zeros((0, 2, 3)))
    assert len(lo) == len(hi) == 0 and offsets.tolist() == [0]
    for nothing in (ll.Scene([], []), ll.Scene(none, np.zeros((0, 3), int)), ll.Scene(VERTICES, [])):
        assert nothing.face_count == 0 and nothing.visible_fraction([0, 0, 0], LAMP) == 1
    x, pdf = ll.sample(LAMP, none, [0, 0, 1], np.zeros((0, 2)))
    assert x.shape == (0, 3) and pdf.shape == (0,)


def test_a_mesh_of_float32_and_uint32_is_not_copied(tmp_path):
    resource = pytest.importorskip("resource")
    n = 1000
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    vertices = np.stack([x, y, np.sin(9 * x) * np.cos(7 * y)], -1).reshape(-1, 3)
    i = np.arange(n * n).reshape(n, n)
    quads = np.stack([i[:-1, :-1], i[:-1, 1:], i[1:, 1:], i[1:, :-1]], -1).reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    code = """
import resource, sys, numpy as np, linelit as ll
vertices, faces = (np.load(name) for name in sys.argv[1:])
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
scene = ll.Scene(vertices, faces, threads=1)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before, scene.face_count)
"""

    def peak(*types):
        """Bytes a triangle by which the peak of the process rises."""
        names = [tmp_path / f"{name}.npy" for name in types]
        for name, array in zip(names, (vertices, faces)):
            np.save(name, array.astype(name.stem))
        run = [sys.executable, "-c", code, *map(str, names)]
        kilobytes, count = map(int, subprocess.check_output(run, text=True).split())
        return kilobytes * 1024 / count

    assert resource.RUSAGE_SELF is not None
    # The converted copies take 6 bytes a triangle for float64 and 12 for int64, and live while the
    # hierarchy is built. At least half of that must show, above noise of about a megabyte.
    assert peak("f8", "i8") - peak("f4", "u4") > 9
