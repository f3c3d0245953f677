"""Values are those of the Rust library, to the bit."""

import pathlib
import shutil
import subprocess

import linelit as ll
import numpy as np
import pytest

CRATE = pathlib.Path(__file__).parent.parent
METHODS = {
    "hybrid": 4,
    "exact": 1,
    "line-analytic": 4,
    "line-solid-angle": 4,
    "point-solid-angle": 4,
    "point-area+line-solid-angle": 4,
}


@pytest.mark.skipif(shutil.which("cargo") is None, reason="there is no cargo")
def test_same_bits_as_the_rust_library(tmp_path):
    rng = np.random.default_rng(1)
    middle = rng.uniform([-1.2, -1.2, 0.4], [1.2, 1.2, 1.6], (24, 1, 3))
    vertices = (middle + rng.uniform(-0.25, 0.25, (24, 3, 3))).reshape(-1, 3).astype(np.float32)
    points = rng.uniform([-1, -1, 0], [1, 1, 0.1], (100_000, 3))
    normals = rng.uniform([-0.5, -0.5, 0.5], [0.5, 0.5, 1], (100_000, 3))
    for name, array in {"vertices": vertices, "points": points, "normals": normals}.items():
        array.tofile(tmp_path / name)
    build = ["cargo", "run", "--profile", "quick", "--quiet", "--example", "points", "--", tmp_path]
    subprocess.check_output([*build, *(f"{name}:{count}" for name, count in METHODS.items())], cwd=CRATE)
    scene = ll.Scene(vertices, np.arange(72, dtype=np.uint32).reshape(-1, 3))
    lamp = ll.Rectangle([-1, -1, 2], [0, 2, 0], [2, 0, 0], radiance=[3.0, 2.0, 1.0])
    for name, samples in METHODS.items():
        want = np.fromfile(tmp_path / name).reshape(-1, 3)
        got = scene.irradiance(points, normals, lamp, method=name, samples=samples, seed=3)
        assert np.array_equal(got, want), name
        assert got.mean() > 0.1


COLOUR, GREY = [0.5, 0.4, 0.3], 0.25
ROUGH, GLOSSY = ll.OrenNayar(COLOUR, 20), ll.Phong(COLOUR, GREY, 30)
REFLECTIONS = {
    "lambert": ll.Lambert(COLOUR),
    "oren-nayar": ROUGH,
    "phong": GLOSSY,
    "metal": ll.Metal([0.2, 0.9, 1.1], [3.9, 2.4, 2.2], 0.2),
    "plastic": ll.Plastic(COLOUR, GREY, 0.2),
    "microfacet": ll.Microfacet(COLOUR, [0.2, 0.2]),
    "substrate": ll.Substrate(COLOUR, GREY, 0.2),
    "frostbite": ll.Frostbite(COLOUR, GREY, 0.4),
    "sum": ROUGH + GLOSSY,
}


@pytest.mark.skipif(shutil.which("cargo") is None, reason="there is no cargo")
def test_radiance_has_the_bits_of_the_rust_library(tmp_path):
    rng = np.random.default_rng(4)
    middle = rng.uniform([-1.2, -1.2, 0.4], [1.2, 1.2, 1.6], (24, 1, 3))
    vertices = (middle + rng.uniform(-0.25, 0.25, (24, 3, 3))).reshape(-1, 3)
    points = rng.uniform([-1, -1, 0], [1, 1, 0.1], (70_000, 3))
    normals, outgoing = rng.uniform([-0.5, -0.5, 0.5], [0.5, 0.5, 1], (2, 70_000, 3))
    arrays = {"vertices": vertices, "points": points, "normals": normals, "outgoing": outgoing}
    for name, array in arrays.items():
        array.tofile(tmp_path / name)
    build = ["cargo", "run", "--profile", "quick", "--quiet", "--example", "reflections", "--", tmp_path]
    subprocess.check_output(build, cwd=CRATE)
    scene = ll.Scene(vertices, np.arange(72).reshape(-1, 3))
    lamp = ll.Rectangle([-1, -1, 2], [0, 2, 0], [2, 0, 0], radiance=[3.0, 2.0, 1.0])
    for name, bsdf in REFLECTIONS.items():
        want = np.fromfile(tmp_path / name).reshape(-1, 3)
        got = scene.radiance(points, normals, bsdf, outgoing, lamp, samples=4, seed=3)
        assert np.array_equal(got, want), name
        each = [bsdf] * 5
        few = scene.radiance(points[:5], normals[:5], each, outgoing[:5], lamp, samples=4, seed=3)
        assert np.array_equal(few, want[:5]), name
        assert got.mean() > 0.02


@pytest.mark.skipif(shutil.which("cargo") is None, reason="there is no cargo")
def test_view_factors_have_the_bits_of_the_rust_library(tmp_path):
    rng = np.random.default_rng(2)
    vertices = (rng.uniform(-1, 1, (40, 1, 3)) + rng.uniform(-0.3, 0.3, (40, 3, 3))).reshape(-1, 3)
    points, directions = rng.uniform(-1, 1, (2, 1000, 3))
    for name, array in {"vertices": vertices, "points": points, "directions": directions}.items():
        array.tofile(tmp_path / name)
    build = ["cargo", "run", "--profile", "quick", "--quiet", "--example", "factors", "--", tmp_path]
    subprocess.check_output(build, cwd=CRATE)
    v = ll.ViewFactors(vertices, np.arange(120).reshape(-1, 3))
    m, seen = v.matrix(1e-2), v.from_point(points, directions)
    got = {
        "factors": np.concatenate([m.data, m.error, m.sky]),
        "columns": np.concatenate([m.indices, m.indptr]).astype(float),
        "facets": seen.facets,
        "sky": seen.sky,
        "sunlit": v.sunlit(directions),
    }
    for name, array in got.items():
        assert np.array_equal(array.ravel(), np.fromfile(tmp_path / name)), name
        assert array.std() > 0.01
