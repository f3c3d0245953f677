"""View factors of a street canyon beside pyviewfactor and raystrack, from Python.

Factors are compared with linelit's at a tolerance of 1e-7, and the pairs where another differs most
with random segments between both facets, in numpy alone. Seconds are those of the whole matrix.
"""

import argparse
import time

import linelit
import numpy as np
import pyvista
from pyviewfactor import compute_viewfactor_matrix
from raystrack import Accuracy, Mesh, Query, Sampling, Scene, SolveOptions, Solver


def wall(corner, u, v, n, m):
    """The squares of a parallelogram of n by m facets: (n m, 4, 3)."""
    corner, u, v = (np.array(a, float) for a in (corner, u, v))
    s, t = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    unit = np.stack([s, t], -1).reshape(-1, 1, 2) + np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    return corner + unit[..., :1] / n * u + unit[..., 1:] / m * v


def house(x, y, w, d, h):
    """Four walls and a roof, of four facets each."""
    up = (0, 0, h)
    return [wall((x, y, 0), (w, 0, 0), up, 2, 2), wall((x + w, y, 0), (0, d, 0), up, 2, 2),
            wall((x + w, y + d, 0), (-w, 0, 0), up, 2, 2), wall((x, y + d, 0), (0, -d, 0), up, 2, 2),
            wall((x, y, h), (w, 0, 0), (0, d, 0), 2, 2)]


def canyon(facets):
    """Two rows of houses along a street, as `crates/viewfactors/examples/streets.rs` has them."""
    houses, parts = round(facets * 0.8 / 40), []
    for k in range(houses):
        y, height = 12.0 * k, 8.0 + k % 4 * 3
        parts += house(-18, y, 10, 10, height) + house(8, y + 3, 10, 10, 20 - height)
    parts.append(wall((-8, 0, 0), (16, 0, 0), (0, 12 * houses, 0), 4, 2 * houses))
    return np.concatenate(parts)


def by_linelit(quads, tolerance):
    polygons = np.arange(4 * len(quads)).reshape(-1, 4)
    m = linelit.ViewFactors(quads.reshape(-1, 3), polygons).matrix(tolerance)
    factors = np.zeros((len(quads), len(quads)))
    factors[np.repeat(np.arange(len(quads)), np.diff(m.indptr)), m.indices] = m.data
    return factors


def by_pyviewfactor(quads):
    faces = np.insert(np.arange(4 * len(quads)).reshape(-1, 4), 0, 4, axis=1)
    mesh = pyvista.PolyData(quads.reshape(-1, 3), faces.ravel())
    # Its matrix has the sender in the column.
    return compute_viewfactor_matrix(mesh, obstacles=mesh.triangulate()).T


def by_raystrack(quads, replicates):
    names = [f"f{i}" for i in range(len(quads))]
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    meshes = {name: Mesh(quad.astype(np.float32), faces) for name, quad in zip(names, quads)}
    # 128 rays for each unit of area and replicate, and all replicates.
    accuracy = Accuracy(max_replicates=replicates, tolerance=0)
    options = SolveOptions(sampling=Sampling(density=1), accuracy=accuracy)
    with Solver(Scene.from_meshes(meshes), device="cpu") as solver:
        found = solver.solve(Query.matrix(receiver_sides=("front",)), options)
    numbers = {name: i for i, name in enumerate(names)}
    columns = np.array([numbers.get(c.surface_id, -1) for c in found.channels])
    rows = np.array([numbers[name] for name in found.sender_ids])
    factors = np.zeros((len(quads), len(quads) + 1))
    factors[rows[found.data.row_indices], columns[found.data.channel_indices]] = found.data.estimates
    return factors[:, :-1]


def by_segments(quads, i, j, random, count):
    """The factor from facet i to j by random segments between them, and its standard error."""
    corner, u, v = quads[:, 0], quads[:, 1] - quads[:, 0], quads[:, 3] - quads[:, 0]
    normal = np.cross(u, v)
    area = np.linalg.norm(normal, axis=1)
    both = quads[[i, j]].reshape(-1, 3)
    near = (quads.max(1) >= both.min(0)).all(1) & (quads.min(1) <= both.max(0)).all(1)
    near[[i, j]] = False
    total, square = 0.0, 0.0
    for _ in range(count // 100_000):
        s = random.random((4, 100_000, 1))
        x, y = corner[i] + s[0] * u[i] + s[1] * v[i], corner[j] + s[2] * u[j] + s[3] * v[j]
        way = y - x
        length = (way ** 2).sum(1)
        cosines = (way @ normal[i]).clip(0) * (-way @ normal[j]).clip(0) / (area[i] * area[j] * length)
        value = area[j] * cosines / (np.pi * length)
        for k in np.flatnonzero(near):
            speed = way @ normal[k]
            with np.errstate(divide="ignore", invalid="ignore"):
                at = (corner[k] - x) @ normal[k] / speed
                hit = x + at[:, None] * way - corner[k]
            a, b = hit @ u[k] / (u[k] @ u[k]), hit @ v[k] / (v[k] @ v[k])
            value[(at > 0) & (at < 1) & (a > 0) & (a < 1) & (b > 0) & (b < 1)] = 0
        total, square = total + value.sum(), square + (value ** 2).sum()
    mean = total / count
    return mean, np.sqrt((square / count - mean ** 2) / count)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--facets", type=int, default=200)
    parser.add_argument("--tolerance", type=float, default=1e-7, help="of the reference")
    parser.add_argument("--replicates", type=int, nargs="*", default=[10, 100], help="of raystrack's rays")
    parser.add_argument("--segments", type=int, default=4_000_000)
    options = parser.parse_args()
    ways = {"linelit 1e-2": lambda quads: by_linelit(quads, 1e-2),
            "linelit 1e-4": lambda quads: by_linelit(quads, 1e-4),
            "pyviewfactor": by_pyviewfactor}
    for count in options.replicates:
        ways[f"raystrack, {count} replicates"] = lambda quads, count=count: by_raystrack(quads, count)
    small, quads = canyon(50), canyon(options.facets)
    start = time.perf_counter()
    exact = by_linelit(quads, options.tolerance)
    print(f"{len(quads)} facets; the reference took {time.perf_counter() - start:.1f} s")
    print("| way | seconds | largest error of a factor | of a row's sum | largest sum |")
    print("|---|---|---|---|---|")
    random = np.random.default_rng(1)
    doubts = []
    for name, way in ways.items():
        way(small)  # Compiles, where there is something to compile.
        start = time.perf_counter()
        factors = way(quads)
        seconds = time.perf_counter() - start
        error = np.abs(factors - exact)
        rows = np.abs(factors.sum(1) - exact.sum(1)).max()
        most = factors.sum(1).max()
        print(f"| {name} | {seconds:.2f} | {error.max():.1e} | {rows:.1e} | {most:.4f} |", flush=True)
        worst = np.argsort(error.ravel())[:-3:-1]
        doubts += [(name, factors, *np.unravel_index(k, error.shape)) for k in worst]
    print("| way | from, to | its factor | linelit | by segments | standard error |")
    print("|---|---|---|---|---|---|")
    for name, factors, i, j in doubts:
        value, error = by_segments(quads, i, j, random, options.segments)
        both = f"{factors[i, j]:.6f} | {exact[i, j]:.6f}"
        print(f"| {name} | {i}, {j} | {both} | {value:.6f} | {error:.1e} |", flush=True)


if __name__ == "__main__":
    main()
