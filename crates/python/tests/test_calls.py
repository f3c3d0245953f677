"""Threads, batches, seeds, Ctrl-C, pictures and studies: how calls behave."""

import signal
import subprocess
import sys
import threading
import time

import linelit as ll
import numpy as np
import pytest

UP = [0.0, 0.0, 1.0]
LAMP = ll.Rectangle([-1, -1, 2], [0, 2, 0], [2, 0, 0], 3.0)
LIGHTS = [LAMP, ll.Sphere([1, 0, 3], 0.5, 2.0), ll.Line([-1, 0, 2.5], [1, 0, 2.5], 1.0)]


def soup(count, seed):
    rng = np.random.default_rng(seed)
    middle = rng.uniform([-1.2, -1.2, 0.4], [1.2, 1.2, 1.6], (count, 1, 3))
    vertices = (middle + rng.uniform(-0.25, 0.25, (count, 3, 3))).reshape(-1, 3)
    return ll.Scene(vertices, np.arange(3 * count).reshape(-1, 3))


SCENE = soup(30, 1)
POINTS = np.random.default_rng(2).uniform([-1, -1, 0], [1, 1, 0.1], (3000, 3))


@pytest.mark.parametrize("method", ["hybrid", "line-analytic", "point-solid-angle"])
def test_bits_depend_on_neither_threads_nor_order_nor_batches(method):
    def values(points, **options):
        return SCENE.irradiance(points, UP, LIGHTS, method=method, samples=4, **options)

    want = values(POINTS)
    for threads in (1, 2, 7):
        assert np.array_equal(values(POINTS, threads=threads), want)
    order = np.random.default_rng(3).permutation(len(POINTS))
    assert np.array_equal(values(POINTS[order]), want[order])
    parts = [values(part) for part in np.array_split(POINTS, 7)]
    assert np.array_equal(np.concatenate(parts), want)
    assert np.array_equal([values(point) for point in POINTS[:20]], want[:20])
    assert not np.array_equal(values(POINTS, seed=1), want)


def test_other_queries_depend_on_no_threads():
    lines = np.stack([POINTS + [0, 0, 2], POINTS[::-1] + [0, 0, 2]], 1)
    want = SCENE.visible_intervals(POINTS, lines, threads=1)
    got = SCENE.visible_intervals(POINTS, lines, threads=7)
    assert all(np.array_equal(a, b) for a, b in zip(want, got))
    assert want[2][-1] > len(POINTS)
    want = SCENE.visible_fraction(POINTS, LAMP, threads=1)
    assert np.array_equal(SCENE.visible_fraction(POINTS, LAMP, threads=7), want)


def test_many_lights_and_methods_on_one_scene_are_kept_apart():
    fresh = soup(30, 1)
    for _ in range(2):
        for k in range(12):
            lamp = ll.Rectangle([-1, -1, 2], [0, 2, 0], [2, 0, 0], 1.0 + k)
            got = SCENE.irradiance(POINTS[:10], UP, lamp, method="exact")
            want = fresh.irradiance(POINTS[:10], UP, LAMP, method="exact") * (1.0 + k) / 3.0
            assert np.allclose(got, want, rtol=1e-14)


def test_other_threads_of_python_run_meanwhile():
    ticks = []
    stop = threading.Event()

    def tick():
        while not stop.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.001)

    scene = soup(400, 4)
    thread = threading.Thread(target=tick)
    thread.start()
    begin = time.perf_counter()
    scene.irradiance(POINTS[:1000], UP, LAMP, samples=64, threads=1)
    end = time.perf_counter()
    stop.set()
    thread.join()
    assert sum(begin < t < end for t in ticks) > 3


def test_calls_from_many_threads_agree():
    want = SCENE.irradiance(POINTS, UP, LAMP, samples=4)
    found = {}

    def ask(k):
        lamp = LAMP if k % 2 else ll.Rectangle([-1, -1, 2], [0, 2, 0], [2, 0, 0], 3.0)
        found[k] = SCENE.irradiance(POINTS, UP, lamp, samples=4, threads=1 + k % 3)

    threads = [threading.Thread(target=ask, args=(k,)) for k in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(found[k], want) for k in range(8))


@pytest.mark.skipif(sys.platform == "win32", reason="signals of another kind")
@pytest.mark.parametrize(
    "call",
    [
        "scene.irradiance(np.zeros((50_000_000, 3)), [0, 0, 1], lamp, samples=1024)",
        "views.from_point(np.zeros((10_000_000, 3)), [0, 0, 1])",
        "views.sunlit(np.ones((10_000_000, 3)))",
        "many.matrix()",
        "ll.render('cornell-box', samples=100_000, resolution=(2000, 2000))",
        "ll.converge('cornell-box', trials=100_000, samples=[1024])",
    ],
)
def test_an_interrupt_ends_a_long_call(call):
    # A process that was started in the background ignores interrupts unless it is told not to.
    code = f"""
import signal, numpy as np, linelit as ll
signal.signal(signal.SIGINT, signal.default_int_handler)
lamp = ll.Rectangle([-1, -1, 2], [0, 2, 0], [2, 0, 0], 3.0)
scene = ll.Scene([[-.1, -.1, 1], [.2, 0, 1], [0, .3, 1]], [[0, 1, 2]])
views = ll.ViewFactors([[-.1, -.1, 1], [0, .3, 1], [.2, 0, 1]], [[0, 1, 2]])
x, y = np.meshgrid(np.arange(32.0), np.arange(32.0))
square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
low = (np.stack([x, y, 0 * x], -1).reshape(-1, 1, 3) + square).reshape(-1, 3)
high = low.reshape(-1, 4, 3)[:, ::-1].reshape(-1, 3) + [0, 0, 9]
many = ll.ViewFactors(np.concatenate([low, high]), np.arange(8192).reshape(-1, 4))
print("ready", flush=True)
try:
    {call}
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""
    run = [sys.executable, "-c", code]
    with subprocess.Popen(run, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout.readline() == "ready\n"
        time.sleep(0.5)
        child.send_signal(signal.SIGINT)
        try:
            out, _ = child.communicate(timeout=60)
        finally:
            child.kill()
    assert out == "interrupted\n" and child.returncode == 0


def test_pictures_have_pixels_and_metadata():
    told = []
    picture = ll.render(
        "cornell-box", samples=2, resolution=(24, 16), progress=lambda done, all: told.append((done, all))
    )
    assert picture.pixels.shape == (16, 24, 3) and picture.pixels.dtype == np.float32
    assert picture.pixels.mean() > 0.01 and told[-1] == (16, 16)
    assert picture.metadata["estimator"].startswith("hybrid") and picture.metadata["samples"] == 2
    again = ll.render("cornell-box", samples=2, resolution=(24, 16), threads=1)
    assert np.array_equal(again.pixels, picture.pixels)
    noisy = ll.render("cornell-box", "point-area", 2, resolution=(24, 16), camera_samples=3, seed=5)
    assert not np.array_equal(noisy.pixels, picture.pixels)


def test_an_error_of_progress_ends_the_call():
    def fail(done, all):
        raise RuntimeError(f"after {done}")

    with pytest.raises(RuntimeError, match="after"):
        ll.render("cornell-box", samples=1, resolution=(8, 64), progress=fail)
    with pytest.raises(RuntimeError, match="after 1"):
        ll.converge("cornell-box", ["point-area"], samples=[1, 4], trials=2, pixels="4x4", progress=fail)


def test_studies_have_columns():
    told = []
    study = ll.converge(
        ["cornell-box", "grid-planes-large"],
        ["point-area", "line-analytic"],
        samples=[1, 4, 16],
        trials=8,
        pixels="8x8",
        progress=lambda done, all: told.append((done, all)),
    )
    assert len(study["mse"]) == 2 * 2 * 3 and study["samples"].dtype.kind == "i"
    assert set(study["estimator"]) == {"point-area", "line-analytic"}
    assert told[-1][0] == told[-1][1] == len(told)
    points = (study["estimator"] == "point-area") & (study["scene"] == study["scene"][0])
    assert (np.diff(study["mse"][points]) < 0).all()
    assert len(study.slopes["order"]) == 4 and '"scenes"' in study.json
    pandas = pytest.importorskip("pandas")
    assert isinstance(study.to_pandas(), pandas.DataFrame)


def test_importing_takes_numpy_alone():
    code = "import sys, linelit; print(sorted({m.split('.')[0] for m in sys.modules}))"
    names = subprocess.check_output([sys.executable, "-c", code], text=True)
    for other in ("trimesh", "mitsuba", "pandas", "matplotlib", "tqdm"):
        assert f"'{other}'" not in names


def test_empty_lists_have_empty_answers():
    assert SCENE.irradiance([], [], LAMP).shape in ((0,), (0, 3))
    assert SCENE.irradiance([], UP, LAMP, method="exact").size == 0
    assert SCENE.irradiance([[0, 0, 0]], UP, []).tolist() == [0.0]
    assert SCENE.visible_fraction([], LAMP).shape == (0,)
    assert SCENE.visible_polygons([], LAMP) == []
    low, high, offsets = SCENE.visible_intervals([], [])
    assert low.size == high.size == 0 and offsets.tolist() == [0]
    x, pdf = ll.sample(LAMP, [], UP, [])
    assert x.shape == (0, 3) and pdf.shape == (0,) and ll.pdf(LAMP, [], UP, []).shape == (0,)
    none = ll.ViewFactors([], [])
    assert none.area.shape == (0,) and none.from_point([], []).facets.shape == (0, 0)
    assert none.matrix().indptr.tolist() == [0] and ll.Scene([], []).face_count == 0


def test_round_lights_have_visible_parts():
    half = ll.Scene([[0, -9, 1], [9, 0, 1], [0, 9, 1]], [[0, 1, 2]])
    points = np.zeros((3, 2, 3))
    for light in (ll.Disk([0, 0, 2], [0, 0, -1], 0.5, 1.0), ll.Sphere([0, 0, 2], 0.5, 1.0)):
        for measure, normals in (("area", None), ("solid-angle", None), ("cosine", UP)):
            found = half.visible_fraction(points, light, measure=measure, normals=normals)
            # Rounding of a few operations, and that of solid angles' integrals.
            assert np.abs(found - 0.5).max() < 1e-12 and found.shape == (3, 2)
        (ring,) = half.visible_polygons(points[0, 0], light)
        assert ring[:, 0].max() < 1e-12 and len(ring) > 100
        for threads in (None, 1):
            many = half.visible_polygons(points.astype("f4"), light, threads=threads)
            assert len(many) == 6 and all(np.array_equal(rings[0], ring) for rings in many)
    ball = ll.Sphere([0, 0, 2], 0.5, 1.0)
    inside = [[0, 0, 2.0], [0.1, 0, 1.9]]
    assert np.isnan(half.visible_fraction(inside, ball)).all()
    assert half.visible_polygons(inside, ball) == [[], []]
    assert not half.irradiance(inside, UP, ball).any()
