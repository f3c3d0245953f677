"""Rays and building: Embree 4.4 and linelit, in turns, on the same triangles and rays.

Hidden or not is asked for rays towards random points of the light: from `random` points of all
triangles, from what the `camera` sees, and as a `fan` of 16 from each sixteenth of the latter. What
is hit first is asked for the rays of the camera itself (`view`). One thread on one processor core.
"""

import argparse
import os
import subprocess
import sys
from collections import defaultdict
from importlib.metadata import files
from pathlib import Path
from statistics import median

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

import scenes  # noqa: E402

SIDE = 512  # The rays of the camera are those of a square picture.
FAN = 16  # As in main.rs.
END = 1e-4  # The part of a ray towards the light that is left out at either end.
OFFSET = 2e-5  # The distance of a ray's origin from its surface, relative to the ray.
KINDS = ("random", "camera", "fan", "view")


def compile_sides(work, compiler):
    """Compiles both sides, and returns their programs."""
    embree = work / "embree"
    options = ["-O3", "-march=native", "-std=c++17"]
    subprocess.run([compiler, *options, HERE / "embree.cpp", "-o", embree, "-ldl"], check=True)
    cargo = ["cargo", "build", "--release", "--manifest-path", HERE / "Cargo.toml"]
    subprocess.run(cargo, check=True)
    target = Path(os.environ.get("CARGO_TARGET_DIR", HERE / "target"))
    return embree, target / "release" / "linelit-beside-embree"


def library_of_wheel():
    """Embree's library in the installed wheel `embreex`."""
    names = (file for file in files("embreex") if file.name.startswith("libembree4"))
    return next(names).locate()


def export(scene, work, ours):
    """Writes triangles and rays of a scene for both sides, and returns the path of its files."""
    path = work / scene.name

    def write(kind, values):
        Path(f"{path}.{kind}").write_bytes(values.tobytes())

    random = np.random.default_rng(3)
    triangles = np.concatenate([*scene.meshes.values(), scenes.quad(*scene.light.corners())])
    positions, numbers = scenes.indexed(triangles)
    write("positions", positions)
    write("triangles", numbers)
    view = camera_rays(scene.camera)
    write("view", view)
    subprocess.run([ours, "distances", path], check=True)
    distances = np.fromfile(f"{path}.distances")
    seen = np.isfinite(distances)
    points = view[seen, :3] + view[seen, 4:7] * (distances[seen] * (1 - OFFSET))[:, None]
    write("camera", rays_between(points, light_points(scene.light, len(points), random)))
    fans = np.repeat(points[::FAN], FAN, axis=0)
    write("fan", rays_between(fans, light_points(scene.light, len(fans), random)))
    goals = light_points(scene.light, SIDE * SIDE, random)
    write("random", rays_between(points_facing(goals, triangles, random), goals))
    return path


def rows(origin, near, direction, far):
    """Rays as both sides read them."""
    rays = np.empty((len(direction), 8), "<f4")
    rays[:, :3], rays[:, 3], rays[:, 4:7], rays[:, 7] = origin, near, direction, far
    return rays


def camera_rays(camera):
    origin, target = np.array(camera.origin, float), np.array(camera.target, float)
    forward = (target - origin) / np.linalg.norm(target - origin)
    right = np.cross(forward, (0, 1, 0))
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    extent = np.tan(np.radians(camera.field_of_view) / 2)
    across = ((np.arange(SIDE) + 0.5) / SIDE * 2 - 1) * extent
    x, y = np.tile(across, SIDE)[:, None], np.repeat(-across, SIDE)[:, None]
    direction = forward + x * right + y * up
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return rows(origin, 0, direction, np.inf)


def rays_between(points, goals):
    """Rays from point to goal, without their ends."""
    origins = points.astype("<f4")
    return rows(origins, END, goals - origins, 1 - END)


def light_points(light, count, random):
    u, v = random.random((2, count, 1))
    return np.array(light.corner) + u * np.array(light.sides[0]) + v * np.array(light.sides[1])


def points_facing(goals, triangles, random):
    """A point for each goal, evenly over the area of all triangles, a little towards the goal."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(normals, axis=1, keepdims=True)
    chosen = random.choice(len(triangles), len(goals), p=areas[:, 0] / areas.sum())
    u, v = random.random((2, len(goals), 1))
    u, v = np.where(u + v > 1, (1 - u, 1 - v), (u, v))
    first, second, third = triangles[chosen].transpose(1, 0, 2)
    points = first + (second - first) * u + (third - first) * v
    ways = goals - points
    normals = (normals / areas)[chosen]
    normals *= np.sign((normals * ways).sum(1, keepdims=True))
    return points + normals * OFFSET * np.linalg.norm(ways, axis=1, keepdims=True)


def measure(path, sides, rounds):
    """The least median time of each side for each kind of work."""
    results = defaultdict(list)
    for _ in range(rounds):
        for side, command in sides.items():
            command = [path if word == "PATH" else word for word in command]
            printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
            for kind, call, seconds, count in map(str.split, printed.splitlines()):
                results[kind, side, call].append((float(seconds), int(count)))
    best = {}
    for (kind, side, call), found in sorted(results.items()):
        seconds = median(seconds for seconds, _ in found)
        best[kind, side] = min(seconds, best.get((kind, side), np.inf))
        counts = {count for _, count in found}
        print(f"{path.name} {kind} {side} {call}: {seconds:.3e} s, hits or triangles {counts}")
    return best


def cells(path, best):
    for kind in KINDS:
        millions = os.path.getsize(f"{path}.{kind}") / 32 * 1e-6
        yield " / ".join(f"{millions / best[kind, side]:.1f}" for side in ("Embree", "linelit"))
    builds = (("build", "Embree"), ("build-for-rays", "linelit"), ("build", "linelit"))
    yield " / ".join(f"{1e3 * best[build]:.3g}" for build in builds)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("work", type=Path, help="a folder for triangles, rays and a program")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--quality", choices=("medium", "high"), default="medium",
                        help="of Embree's hierarchy")
    parser.add_argument("--compiler", default="g++")
    parser.add_argument("--core", type=int, default=0, help="the processor core to run on")
    options = parser.parse_args()
    options.work.mkdir(parents=True, exist_ok=True)
    embree, ours = compile_sides(options.work, options.compiler)
    os.sched_setaffinity(0, {options.core})
    quality = {"medium": "1", "high": "2"}[options.quality]
    sides = {
        "Embree": [embree, library_of_wheel(), "PATH", quality],
        "linelit": [ours, "time", "PATH"],
    }
    tables = {}
    for scene in scenes.SCENES.values():
        path = export(scene(), options.work, ours)
        tables[path] = measure(path, sides, options.rounds)
    print(f"\nLoad {os.getloadavg()[0]:.1f}; million rays a second, Embree / linelit, and")
    print("milliseconds to build, Embree / linelit for rays / linelit for shafts:\n")
    print(f"| scene | {' | '.join(KINDS)} | build |\n|{'---|' * (len(KINDS) + 2)}")
    for path, best in tables.items():
        print(f"| {path.name} | {' | '.join(cells(path, best))} |")


if __name__ == "__main__":
    main()
