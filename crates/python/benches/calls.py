"""Measure the time of calls compared with the Rust library, in an environment with the wheel.

``python benches/calls.py`` builds the example ``points`` with the profile of the wheel, and prints
for each method the time of 10,000 points and what a call with one point takes more than in Rust.
"""

import pathlib
import subprocess
import tempfile
import time

import linelit as ll
import numpy as np

METHODS = {"hybrid": 4, "exact": 1, "line-analytic": 4, "point-solid-angle": 4}
CRATE = pathlib.Path(__file__).parent.parent


def least(count, call):
    times = []
    for _ in range(count):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return min(times)


def main():
    rng = np.random.default_rng(1)
    middle = rng.uniform([-1.2, -1.2, 0.4], [1.2, 1.2, 1.6], (24, 1, 3))
    vertices = (middle + rng.uniform(-0.25, 0.25, (24, 3, 3))).reshape(-1, 3).astype(np.float32)
    points = rng.uniform([-1, -1, 0], [1, 1, 0.1], (10_000, 3))
    normals = rng.uniform([-0.5, -0.5, 0.5], [0.5, 0.5, 1], (10_000, 3))
    scene = ll.Scene(vertices, np.arange(72, dtype=np.uint32).reshape(-1, 3))
    lamp = ll.Rectangle([-1, -1, 2], [0, 2, 0], [2, 0, 0], radiance=[3.0, 2.0, 1.0])
    with tempfile.TemporaryDirectory() as folder:
        for name, array in {"vertices": vertices, "points": points, "normals": normals}.items():
            array.tofile(f"{folder}/{name}")
        rust = ["cargo", "run", "--release", "--quiet", "--example", "points", "--", folder]
        told = subprocess.check_output([*rust, *(f"{m}:{n}" for m, n in METHODS.items())], cwd=CRATE, text=True)
    rust = {name: (float(many), float(one)) for name, many, one in map(str.split, told.splitlines())}
    print("method             Rust, ms  Python, ms  throughput  1 to 2 threads  one point, us over Rust")
    for name, samples in METHODS.items():
        options = {"method": name, "samples": samples}
        many, one = rust[name]

        def call(**more):
            return scene.irradiance(points, normals, lamp, **options, **more)

        def calls():
            for i in range(1000):
                scene.irradiance(points[i], normals[i], lamp, **options)

        ours, single = least(9, call), least(9, calls) / 1000
        scaling = least(9, lambda: call(threads=1)) / least(9, lambda: call(threads=2))
        print(
            f"{name:18} {many * 1e3:8.2f} {ours * 1e3:11.2f} {many / ours:11.2f} {scaling:15.2f}"
            f" {(single - one) * 1e6:24.2f}"
        )


if __name__ == "__main__":
    main()
