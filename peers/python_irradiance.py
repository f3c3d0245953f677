"""Irradiance from a square lamp behind blinds, at 1,000 points, from Python, on one thread.

The slats are parallel to the lamp, so that their shadows on its plane are rectangles: the reference
is the closed form of the lamp's irradiance less that of each shadow, in numpy's `longdouble`.
Ray tracers take the same stratified points of the lamp, and their seconds are those of the rays
alone, from numpy's arrays and back; linelit's are those of the whole call.
"""

import argparse
import time

import drjit
import linelit
import mitsuba
import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

# Sides of rectangles: x from and to, y from and to. All are exact in float32.
LAMP, LAMP_HEIGHT = (-0.5, 0.5, -0.5, 0.5), 2.0
SLATS, SLAT_HEIGHT = [(k / 8 - 3 / 64, k / 8 + 1 / 64, -0.75, 0.5) for k in range(-6, 7)], 1.0
UP = np.array([0.0, 0.0, 1.0])


def slats():
    """The vertices and faces of the blinds: two triangles for each slat."""
    vertices = [(x, y, SLAT_HEIGHT) for x0, x1, y0, y1 in SLATS
                for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
    faces = [(4 * k, 4 * k + i, 4 * k + i + 1) for k in range(len(SLATS)) for i in (1, 2)]
    return np.array(vertices, np.float32), np.array(faces, np.uint32)


def reference(points):
    """Irradiance from the visible part of the lamp, of radiance 1."""
    x, y = points[:, :2].T.astype(np.longdouble)
    x0, x1, y0, y1 = LAMP
    total = rectangle(x0 - x, x1 - x, y0 - y, y1 - y)
    scale = LAMP_HEIGHT / SLAT_HEIGHT
    for a0, a1, b0, b1 in SLATS:
        shadow = ([np.clip(x + scale * (a - x), x0, x1) - x for a in (a0, a1)]
                  + [np.clip(y + scale * (b - y), y0, y1) - y for b in (b0, b1)])
        total -= rectangle(*shadow)
    return total


def rectangle(x0, x1, y0, y1):
    """Irradiance from a rectangle parallel to the surface, by places relative to the point."""
    def corner(x, y):
        a, b = np.hypot(x, LAMP_HEIGHT), np.hypot(y, LAMP_HEIGHT)
        return (x / a * np.arctan(y / a) + y / b * np.arctan(x / b)) / 2

    return corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0)


def stratified(points, side, random):
    """Rays from each point to jittered points of the lamp, and what each adds if it gets there."""
    cells = np.stack(np.meshgrid(*[np.arange(side)] * 2), -1).reshape(-1, 2)
    on_lamp = (cells + random.random((len(points), side * side, 2))) / side
    x0, x1, y0, y1 = LAMP
    low, size = np.array((x0, y0)), np.array((x1 - x0, y1 - y0))
    ends = np.concatenate(
        [low + size * on_lamp, np.full_like(on_lamp[..., :1], LAMP_HEIGHT)], -1)
    rays = ends - points[:, None]
    weights = size.prod() * rays[..., 2] ** 2 / (rays ** 2).sum(-1) ** 2 / side ** 2
    origins = np.broadcast_to(points[:, None], rays.shape)
    return [a.reshape(-1, 3).astype(np.float32) for a in (origins, rays)], weights


def of_mitsuba(variant):
    """A function that tells which rays are hidden, by a variant of Mitsuba."""
    mitsuba.set_variant(variant)
    vertices, faces = slats()
    mesh = mitsuba.Mesh("slats", len(vertices), len(faces))
    parameters = mitsuba.traverse(mesh)
    parameters["vertex_positions"], parameters["faces"] = vertices.ravel(), faces.ravel()
    parameters.update()
    scene = mitsuba.load_dict({"type": "scene", "slats": mesh})

    # Types belong to the variant that is set now.
    ray3f, point3f, vector3f = mitsuba.Ray3f, mitsuba.Point3f, mitsuba.Vector3f

    def ray(origin, direction):
        return ray3f(o=origin, d=direction, maxt=1.0, time=0.0, wavelengths=[])

    def one_by_one(origins, rays):
        return np.array([scene.ray_test(ray(o, d)) for o, d in zip(origins, rays)])

    def all_at_once(origins, rays):
        return np.array(scene.ray_test(ray(point3f(origins.T), vector3f(rays.T))))

    return one_by_one if variant.startswith("scalar") else all_at_once


def of_embree():
    """A function that tells which rays are hidden, by Embree."""
    scene = EmbreeScene()
    vertices, faces = slats()
    TriangleMesh(scene, vertices, faces.astype(np.int32))

    def hidden(origins, rays):
        # Lengths of rays: a ray ends at the lamp. The answer is -1 where nothing is hit.
        return scene.run(origins, rays, np.ones(len(rays), np.float32), query="OCCLUDED") >= 0

    return hidden


def timed(call):
    """The answer of a call, and the median of its seconds in three rounds after a first."""
    seconds = []
    answer = call()
    for _ in range(3):
        start = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - start)
    return answer, np.median(seconds)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=1000)
    options = parser.parse_args()
    drjit.set_thread_count(1)
    random = np.random.default_rng(1)
    points = random.uniform(-0.75, 0.75, (options.points, 3)).astype(np.float32).astype(float)
    points[:, 2] = 0.0
    expected = reference(points)
    print("| method | samples | relative RMSE | maximum error / mean | seconds |")
    print("|---|---|---|---|---|")

    def row(method, samples, irradiance, seconds):
        error = np.abs(irradiance - expected) / expected.mean()
        rmse = np.sqrt((error ** 2).mean())
        print(f"| {method} | {samples} | {rmse:.1e} | {error.max():.1e} | {seconds:.4f} |")

    scene = linelit.Scene(*slats())
    x0, x1, y0, y1 = LAMP
    lamp = linelit.Rectangle((x0, y0, LAMP_HEIGHT), (0, y1 - y0, 0), (x1 - x0, 0, 0), radiance=1.0)
    for method, samples in [("exact", 1), ("hybrid", 16), ("line-analytic", 16)]:
        row(f"linelit {method}", samples if method != "exact" else "–", *timed(
            lambda: scene.irradiance(points, UP, lamp, method=method, samples=samples, threads=1)))
    ways = {f"Mitsuba {variant}": of_mitsuba(variant) for variant in ("scalar_rgb", "llvm_ad_rgb")}
    ways["Embree"] = of_embree()
    for side in (4, 8, 16, 32):
        rays, weights = stratified(points, side, random)
        for name, hidden in ways.items():
            answer, seconds = timed(lambda: hidden(*rays))
            row(name, side * side, (weights * ~answer.reshape(weights.shape)).sum(1), seconds)


if __name__ == "__main__":
    main()
