"""View factors: closed forms, closure, values with something in between, and how calls behave."""

import subprocess
import sys
import threading
import time

import linelit as ll
import numpy as np
import pytest

UP = [0.0, 0.0, 1.0]
LOW = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
HIGH = LOW[::-1] + UP
WALL = np.array([[0.0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]])
# The factor between both squares with nothing in between.
OPEN = 0.199824895698


def facets(*corners, sides=1):
    """View factors of polygons by their corners."""
    ends = np.cumsum([len(each) for each in corners])
    polygons = [list(range(end - len(each), end)) for each, end in zip(corners, ends)]
    return ll.ViewFactors(np.concatenate(corners), polygons, sides)


def box(low, high, inside, n=1):
    """The squares of a box, n × n on each side, seen from inside or outside."""
    low, high = np.array(low), np.array(high)
    squares = []
    for axis in range(3):
        for end in (0.0, 1.0):
            for i in range(n):
                for j in range(n):
                    unit = np.empty((4, 3))
                    unit[:, axis] = end
                    unit[:, (axis + 1) % 3] = (np.array([0, 1, 1, 0]) + i) / n
                    unit[:, (axis + 2) % 3] = (np.array([0, 0, 1, 1]) + j) / n
                    square = low + unit * (high - low)
                    squares.append(square[::-1] if (end == 1.0) == inside else square)
    return squares


# Coordinates of the box are exact in float32, so that nothing is moved.
ROOM = facets(
    *box([-1, -1, -1], [1, 1, 1], True, 2), *box([-0.25, -0.5, -0.75], [0.375, 0.125, 0], False)
)


def dense(matrix):
    n = len(matrix.sky)
    out = np.zeros((n, n))
    rows = np.repeat(np.arange(n), np.diff(matrix.indptr))
    out[rows, matrix.indices] = matrix.data
    return out


def test_a_quarter_blocker_half_way_hides_a_quarter():
    v = facets(LOW, HIGH, LOW * 0.5 + [0, 0, 0.5])
    for tolerance in (1e-3, 1e-6, 1e-9):
        found = v.between(0, 1, tolerance=tolerance)
        assert found.error <= tolerance
        assert abs(found.value - 0.149868671774) <= found.error + 1e-12
        assert v.between(1, 0, tolerance) == found
    assert isinstance(found.value, float)
    assert facets(LOW, HIGH).between(0, 1, 1e-10).value == pytest.approx(OPEN, abs=1e-12)


def test_triangles_with_an_obstruction_that_touches_both():
    # Coordinates as published by u-dales; each side of the triangles sends a half.
    first = [[2217.833008, 1853.818848, 0], [2217.506348, 1853.365601, 0], [2217.833008, 1853.818848, 66.900002]]
    second = [
        [2218.230957, 1854.916382, 0],
        [2218.230957, 1854.916382, 66.900002],
        [2201.107910, 1845.251709, 66.900002],
    ]
    between = [[2217.864990, 1854.129883, 0], [2217.833008, 1853.818848, 0], [2217.864990, 1854.129883, 66.900002]]
    v = facets(first, second, between, sides=2)
    assert 0 < v.displacement < 1e-5
    assert 2 * v.between(0, 1, 1e-7).value == pytest.approx(0.753768, abs=2e-6 + 2e-7)
    assert 2 * v.between(1, 0, 1e-8).value == pytest.approx(0.02141796, abs=6e-8 + 2e-8)


def parallel(x, y):
    """Howell's C-11: equal rectangles of x by y that face each other at distance 1."""
    a, b = np.hypot(1, x), np.hypot(1, y)
    return (
        2
        / (np.pi * x * y)
        * (
            np.log(a * b / np.sqrt(1 + x * x + y * y))
            + x * b * np.arctan(x / b)
            + y * a * np.arctan(y / a)
            - x * np.arctan(x)
            - y * np.arctan(y)
        )
    )


def perpendicular(h, w):
    """Howell's C-14: from w to h, rectangles at a right angle with a common edge of length 1."""
    r = h * h + w * w
    logarithm = np.log((1 + w * w) * (1 + h * h) / (1 + r)) / 4
    logarithm += w * w / 4 * np.log(w * w * (1 + r) / ((1 + w * w) * r))
    logarithm += h * h / 4 * np.log(h * h * (1 + r) / ((1 + h * h) * r))
    angles = w * np.arctan(1 / w) + h * np.arctan(1 / h) - np.sqrt(r) * np.arctan(1 / np.sqrt(r))
    return (angles + logarithm) / (np.pi * w)


@pytest.mark.parametrize("x, y", [(1.0, 1.0), (0.25, 4.0), (8.0, 0.5)])
def test_closed_forms_of_rectangles(x, y):
    # Powers of two are exact in float32, so that nothing is moved.
    found = facets(LOW * [x, y, 1], HIGH * [x, y, 1]).between(0, 1, 1e-9)
    assert abs(found.value - parallel(x, y)) <= found.error + 1e-12
    found = facets(LOW * [x, 1, 1], WALL * [1, 1, y]).between(0, 1, 1e-7)
    assert abs(found.value - perpendicular(y, x)) <= found.error + 1e-12


def test_strips_by_crossed_strings():
    # Two long strips of width 1 at distance 1, with one of width 0.5 half-way between them. In the
    # method of crossed strings, the strings go around the edges of the middle strip.
    long = [1, 2e5, 1]
    patch, other = LOW - [0, 0.5, 0], (HIGH - [0, 0.5, 0]) * long
    v = facets(patch, other, (LOW - [0, 0.5, 0]) * [0.5, 2e5, 1] + [0.25, 0, 0.5])
    found = v.between(0, 1, 1e-6)
    assert abs(found.value - (2 * np.hypot(0.25, 0.5) - 1)) <= found.error + 1e-9


def test_points_in_closed_rooms_see_one():
    rng = np.random.default_rng(3)
    fins = [rng.uniform(-0.6, 0.6, (1, 3)) + rng.uniform(-0.3, 0.3, (3, 3)) for _ in range(20)]
    v = facets(*box([-1, -1.3, -0.7], [1, 1.2, 0.9], True, 3), *fins, sides=2)
    points = rng.uniform(-0.65, 0.65, (5, 20, 3))
    seen = v.from_point(points, rng.normal(size=points.shape))
    assert seen.facets.shape == (5, 20, len(v)) and seen.sky.shape == (5, 20)
    # The factor of each of the 74 facets has a relative error of at most 1e-12.
    assert np.abs(seen.sky).max() < 1e-11 and seen.facets.min() >= 0
    one = v.from_point(points[2, 3], UP)
    assert one.facets.shape == (len(v),) and isinstance(one.sky, np.float64)
    assert one.sky == 1 - one.facets.sum() or abs(one.sky) < 1e-11


def test_rows_of_a_room_with_a_box_add_up_to_one():
    m = ROOM.matrix(1e-3)
    error = np.add.reduceat(m.error, m.indptr[:-1])
    assert (error <= 1e-3).all()
    all = dense(m)
    assert (np.abs(all.sum(1) - 1) <= error + 1e-12).all()
    assert np.allclose(all.sum(1) + m.sky, 1, atol=1e-15, rtol=0)
    # Reciprocity holds up to the rounding of the division by the area.
    exchange = ROOM.area[:, None] * all
    assert np.allclose(exchange, exchange.T, rtol=1e-15, atol=0)
    for i, j in [(0, 20), (3, 9), (21, 25)]:
        found = ROOM.between(i, j, 1e-5)
        assert abs(found.value - all[i, j]) <= found.error + error[i]


def test_a_facet_is_the_mean_of_its_points():
    # Take the mean over the midpoints of 40 × 40 cells, which has an error of about 1e-4.
    x = (np.arange(40) + 0.5) / 40
    points = np.stack(np.meshgrid(x, x, [0.0]), -1).reshape(-1, 3)
    v = facets(LOW, HIGH, LOW * 0.5 + [0, 0, 0.5])
    mean = v.from_point(points, UP).facets.mean(0)
    assert mean[0] == 0 and mean[1] == pytest.approx(0.75 * OPEN, abs=1e-4)


@pytest.mark.parametrize("n, m", [(1, 1), (2, 1), (1, 2), (3, 2)])
def test_a_divided_screen_hides_as_much_as_a_whole_one(n, m):
    # The screen is at a right angle to a wall and below a lid. It hides as much of the lid when it
    # is divided into facets.
    wall = np.array([[9.0, 0, 3], [6, 0, 3], [6, 0, 7], [9, 0, 7]])
    lid = np.array([[0.0, 0, 10], [0, 16, 10], [24, 16, 10], [24, 0, 10]])
    u, v = np.array([0, -16.0, 0]), np.array([0, 0, 2.0])
    corners = [[0, 0], [1, 0], [1, 1], [0, 1]]
    screen = [
        [[7, 16, 5] + (i + s) / n * u + (j + t) / m * v for s, t in corners] for i in range(n) for j in range(m)
    ]
    found = facets(wall, lid, *screen).between(0, 1, 1e-4)
    x = (np.arange(50) + 0.5) / 50
    points = np.array([6, 0, 3]) + np.stack(np.meshgrid(3 * x, [0.0], 4 * x), -1).reshape(-1, 3)
    mean = facets(wall, lid, *screen).from_point(points, [0, 1, 0]).facets[:, 1].mean()
    # The mean over 50 × 50 midpoints has an error of about 1e-5.
    assert abs(found.value - mean) <= found.error + 5e-5


def test_the_matrix_is_that_of_scipy():
    sparse = pytest.importorskip("scipy.sparse")
    m = ROOM.matrix(1e-2)
    found = sparse.csr_matrix((m.data, m.indices, m.indptr), shape=(len(ROOM), len(ROOM)))
    assert np.array_equal(found.toarray(), dense(m))


def test_the_sun_casts_parallel_shadows():
    floor, plate = LOW * 2, LOW + [0.25, 0.5, 1]
    v = facets(floor, plate)
    assert v.sunlit([0, 0, 3]).tolist() == pytest.approx([0.75, 1], abs=1e-15)
    # At 45 degrees, a quarter of the plate's shadow misses the floor.
    directions = np.array([[0, 0, 1], [-1, 0, 1], [0, 0, -1], [1, 0, 0]])
    want = np.array([[0.75, 1], [1 - 0.75 * 0.25, 1], [0, 0], [0, 0]])
    assert np.allclose(v.sunlit(directions), want, atol=1e-15)
    assert np.array_equal(v.sunlit(directions.reshape(2, 2, 3), 1), want[:, 1].reshape(2, 2))
    one = v.sunlit([0.0, 0.0, 1.0], 0)
    assert isinstance(one, np.float64) and one == pytest.approx(0.75, abs=1e-15)
    assert facets(floor, plate, sides=2).sunlit([1.5, 0, -1], 1) == pytest.approx(0.75, abs=1e-15)


@pytest.mark.parametrize("give", [list, tuple, np.array, lambda a: [np.array(row, "u2") for row in a]])
def test_polygons_are_an_array_or_a_list(give):
    vertices = np.concatenate([LOW, HIGH])
    v = ll.ViewFactors(vertices, give([[0, 1, 2, 3], [4, 5, 6, 7]]))
    assert len(v) == 2 and v.area.tolist() == [1, 1] and v.displacement == 0
    assert v.between(0, 1, 1e-10).value == pytest.approx(OPEN, abs=1e-12)
    for triangles in ([[0, 1, 2], [4, 5, 6, 7]], np.array([[0, 1, 2], [0, 2, 3]], ">i4")):
        assert len(ll.ViewFactors(vertices.astype("f4"), triangles)) == 2


def test_nothing_gives_nothing():
    for none in (ll.ViewFactors([], []), ll.ViewFactors(LOW, np.zeros((0, 3), int))):
        assert len(none) == 0 and none.area.shape == none.sunlit(UP).shape == (0,)
        m = none.matrix()
        assert m.data.shape == m.sky.shape == (0,) and m.indptr.tolist() == [0]
        seen = none.from_point(LOW, UP)
        assert seen.facets.shape == (4, 0) and seen.sky.tolist() == [1] * 4
    seen = ROOM.from_point(np.zeros((3, 0, 3)), UP)
    assert seen.facets.shape == (3, 0, len(ROOM)) and seen.sky.shape == (3, 0)
    assert ROOM.sunlit(np.zeros((0, 3))).shape == (0, len(ROOM))


def test_bits_depend_on_no_threads():
    rng = np.random.default_rng(4)
    points, directions = rng.uniform(-0.9, 0.9, (300, 3)), rng.normal(size=(300, 3))

    def values(**options):
        seen = ROOM.from_point(points, directions, **options)
        return [*ROOM.matrix(1e-2, **options), *seen, ROOM.sunlit(directions, **options)]

    want = values(threads=1)
    for options in ({"threads": 7}, {}):
        assert all(np.array_equal(a, b) for a, b in zip(values(**options), want))
    alone = [ROOM.from_point(point, normal).sky for point, normal in zip(points, directions)]
    assert np.array_equal(alone, want[-2])


def test_other_threads_of_python_run_meanwhile():
    blocked = facets(LOW, HIGH, LOW * 0.5 + [0, 0.1, 0.5])
    ticks = []
    stop = threading.Event()

    def tick():
        while not stop.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.001)

    for call in (lambda: ROOM.matrix(1e-4, threads=1), lambda: blocked.between(0, 1, 1e-11)):
        stop.clear()
        ticks.clear()
        thread = threading.Thread(target=tick)
        thread.start()
        begin = time.perf_counter()
        call()
        end = time.perf_counter()
        stop.set()
        thread.join()
        assert sum(begin < t < end for t in ticks) > 3


def test_a_call_without_room_is_refused():
    code = """
import resource, numpy as np, linelit as ll
square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
v = ll.ViewFactors(square, np.tile(np.arange(4), (1000, 1)))
resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
try:
    v.from_point(np.zeros((1 << 20, 3)), [0, 0, 1])
except MemoryError as error:
    print(error)
"""
    pytest.importorskip("resource")
    if sys.platform != "linux":
        pytest.skip("the limit is not kept")
    told = subprocess.check_output([sys.executable, "-c", code], text=True)
    assert told == "1048576 rows of 1000 factors\n"
