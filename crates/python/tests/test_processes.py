"""Forks, interrupts and pickles."""

import copy
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import threading
import time

import linelit as ll
import numpy as np
import pytest

UP = np.array([0.0, 0.0, 1.0])
POINTS = np.random.default_rng(5).uniform([-1, -1, 0], [1, 1, 0.1], (9000, 3))
VERTICES = np.array([[-0.2, -0.1, 1], [0.25, -0.05, 1], [0, 0.2, 1.1]])
LAMP = ll.Rectangle([-1, -1, 5], [0, 2, 0], [2, 0, 0], radiance=1.0)
SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
WALL = [[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]]
CORNERS = np.concatenate([SQUARE, WALL, SQUARE[:3] / 2 + [0.2, 0.1, 0.3]])
VIEWS = ll.ViewFactors(CORNERS, [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10]], 2)
unix = pytest.mark.skipif(sys.platform == "win32", reason="no forks, and signals of another kind")


def irradiance(**options):
    return ll.Scene(VERTICES, [[0, 1, 2]]).irradiance(POINTS, UP, LAMP, **options)


def study():
    return ll.converge("cornell-box", ["point-area"], samples=[1, 2], trials=2, pixels="4x4")["mse"]


# Calls that take more than one thread.
PARALLEL = {
    "irradiance": irradiance,
    "one thread": lambda: irradiance(threads=1),
    "exact": lambda: irradiance(method="exact", threads=2),
    "fraction": lambda: ll.Scene(VERTICES, [[0, 1, 2]]).visible_fraction(POINTS, LAMP),
    "from_point": lambda: VIEWS.from_point(POINTS, UP).facets,
    "matrix": lambda: VIEWS.matrix(1e-3).data,
    "facets": lambda: ll.ViewFactors(np.tile(SQUARE, (99, 1)), np.arange(396).reshape(-1, 4)).area,
    "render": lambda: ll.render("cornell-box", samples=1, resolution=(16, 16)).pixels,
    "converge": study,
}


def in_child(call):
    """What a forked child computes, as bytes."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            with os.fdopen(writer, "wb") as file:
                file.write(np.ascontiguousarray(call()).tobytes())
        finally:
            os._exit(0)
    os.close(writer)
    end = threading.Timer(60, lambda: os.kill(child, signal.SIGKILL))
    end.start()
    with os.fdopen(reader, "rb") as file:
        found = file.read()
    end.cancel()
    os.waitpid(child, 0)
    return found


@unix
@pytest.mark.parametrize("name", PARALLEL)
def test_a_forked_child_has_the_bits_of_its_parent(name):
    call = PARALLEL[name]
    want = np.ascontiguousarray(call()).tobytes()
    assert in_child(call) == want
    # Also compute in a child and in its own child, each of which starts its own threads.
    assert in_child(lambda: np.frombuffer(call() is not None and in_child(call), np.uint8)) == want
    # The parent can still use its threads.
    assert np.ascontiguousarray(call()).tobytes() == want


def total(number):
    scene = ll.Scene(VERTICES * (1 + number % 3), [[0, 1, 2]])
    return float(scene.irradiance(POINTS, UP, LAMP, method="exact").sum())


@unix
def test_a_pool_of_forked_processes_works_in_all_of_them():
    want = [total(k) for k in range(12)]
    with multiprocessing.get_context("fork").Pool(4) as pool:
        assert pool.map_async(total, range(12), chunksize=1).get(60) == want
        # Fork more processes while this one computes.
        thread = threading.Thread(target=total, args=(0,))
        thread.start()
        with multiprocessing.get_context("fork").Pool(2) as more:
            assert more.map_async(total, range(4)).get(60) == want[:4]
        thread.join()


def with_scene(scene, views, lights):
    found = scene.irradiance(POINTS[:100], UP, lights, samples=2)
    return found.tobytes(), views.matrix(1e-3).data.tobytes()


def test_other_processes_take_scenes_lights_and_facets():
    scene = ll.Scene(VERTICES, [[0, 1, 2]], surface_offset=1e-3, light_margin=0.01)
    want = with_scene(scene, VIEWS, [LAMP])
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.apply_async(with_scene, (scene, VIEWS, [LAMP])).get(120) == want


rng = np.random.default_rng(2)
TURN = np.linalg.qr(rng.normal(size=(3, 3)))[0]
LIGHTS = {
    "polygon": ll.Polygon(rng.normal(size=(3, 3)), [1.0, 2.0, 3.0], two_sided=True),
    "rectangle": ll.Rectangle(rng.normal(size=3), rng.normal(size=3), rng.normal(size=3), 1.0),
    "disk": ll.Disk(rng.normal(size=3), rng.normal(size=3), 0.7, [1.0, 0.0, 3.0]),
    "two-sided disk": ll.Disk(rng.normal(size=3), rng.normal(size=3), 0.7, 2.0, two_sided=True),
    "sphere": ll.Sphere(rng.normal(size=3), 0.3, 1.0),
    "cylinder": ll.Cylinder(rng.normal(size=3), rng.normal(size=3), 0.2, [3.0, 2.0, 1.0]),
    "line": ll.Line(rng.normal(size=3), rng.normal(size=3), 1.0),
    "point": ll.Point(rng.normal(size=3), 1.0),
    "spot": ll.Spot(rng.normal(size=3), rng.normal(size=3), 0.3, 2.5, 1.0),
    "distant": ll.Distant(rng.normal(size=3), [1.0, 2.0, 3.0]),
    "sun": ll.Sun(rng.normal(size=3), 0.2, 5.0),
    "environment": ll.Environment(0.3),
    "scaled environment": ll.Environment(0.3, scale=[1.0, 2.0, 3.0]),
    "image": ll.Environment(rng.random((8, 16, 3)), scale=[0.1, 1.0, 3.0], to_image=TURN),
}
SCENE = ll.Scene(rng.normal(size=(30, 3)), np.arange(30).reshape(-1, 3))


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
@pytest.mark.parametrize("name", LIGHTS)
def test_a_light_that_was_pickled_gives_the_same_bits(name, protocol):
    light = LIGHTS[name]
    again = pickle.loads(pickle.dumps(light, protocol))
    points, normals = np.random.default_rng(4).normal(size=(2, 50, 3)) * 2
    values = [SCENE.irradiance(points, normals, each, samples=4) for each in (light, again)]
    assert repr(again) == repr(light) and values[0].shape == values[1].shape
    assert values[0].tobytes() == values[1].tobytes() and values[0].any()
    # Pickling the copy again gives the same bytes.
    assert pickle.dumps(again, protocol) == pickle.dumps(light, protocol)


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
@pytest.mark.parametrize("dtype", ["f4", "f8"])
def test_a_scene_that_was_pickled_gives_the_same_bits(dtype, protocol):
    vertices = np.random.default_rng(3).normal(size=(60, 3)).astype(dtype)
    faces = np.random.default_rng(3).integers(0, 60, (40, 3))
    faces[7] = 3
    scene = ll.Scene(vertices, faces, surface_offset=0.01, light_margin=0.02)
    want = scene.irradiance(POINTS[:200], UP, LAMP, samples=2)
    # The scene must not depend on the arrays, which the caller may change.
    vertices[:] = 0
    faces[:] = 0
    again = pickle.loads(pickle.dumps(scene, protocol))
    assert repr(again) == repr(scene) and again.memory == scene.memory
    assert np.array_equal(again.irradiance(POINTS[:200], UP, LAMP, samples=2), want)
    none = pickle.loads(pickle.dumps(ll.Scene([], []), protocol))
    assert none.face_count == 0


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_facets_that_were_pickled_give_the_same_bits(protocol):
    for views in (VIEWS, ll.ViewFactors(CORNERS[:8] + 1e5, [[0, 1, 2, 3], [4, 5, 6, 7]]), ll.ViewFactors([], [])):
        again = pickle.loads(pickle.dumps(views, protocol))
        want, got = views.matrix(1e-3), again.matrix(1e-3)
        assert len(again) == len(views) and again.displacement == views.displacement
        assert all(np.array_equal(a, b) for a, b in zip(want, got))


def test_a_reflection_that_was_pickled_gives_the_same_bits():
    scene, up = ll.Scene([], []), [0, 0, 1]
    lamp = ll.Rectangle([-1, -1, 2], [0, 2, 0], [2, 0, 0], radiance=4.0)
    anisotropic = ll.Metal([0.2, 0.9, 1.1], 3.9, [0.1, 0.3], tangent=[1, 2, 0])
    for bsdf in ll.Lambert(0.5), ll.Plastic([0.5, 0.4, 0.3], 0.2, 0.1, eta=1.7), anisotropic + ll.Lambert(0.1):
        again = pickle.loads(pickle.dumps(bsdf))
        a, b = (scene.radiance([0, 0, 0], up, one, [1, 0, 1], lamp) for one in (bsdf, again))
        assert np.array_equal(a, b) and a.shape == b.shape and repr(again) == repr(bsdf)


def test_answers_can_be_pickled():
    for answer in (VIEWS.matrix(1e-3), VIEWS.between(0, 1), VIEWS.from_point([0, 0, 1], UP)):
        again = pickle.loads(pickle.dumps(answer))
        assert type(again) is type(answer)
        assert all(np.array_equal(a, b) for a, b in zip(again, answer))
    picture = pickle.loads(pickle.dumps(ll.render("cornell-box", samples=1, resolution=(4, 4))))
    assert picture.metadata["samples"] == 1
    found = ll.converge("cornell-box", ["point-area"], samples=[1, 2], trials=2, pixels="4x4")
    again = pickle.loads(pickle.dumps(found))
    assert again.json == found.json and np.array_equal(again["mse"], found["mse"])


def test_a_copy_is_the_thing_itself():
    for each in (LAMP, SCENE, VIEWS):
        assert copy.copy(each) is each and copy.deepcopy([each])[0] is each


# Calls that last for at least half a minute: for each, the code that prepares it, and the call.
LONG = {
    "Scene": ("V, F = soup(2_000_000)", "[ll.Scene(V, F) for _ in range(99)]"),
    "ViewFactors": ("V, F = soup(100_000)", "[ll.ViewFactors(V, F) for _ in range(99)]"),
    "matrix": ("v = ll.ViewFactors(*soup(3000))", "v.matrix(1e-7)"),
    "between": (
        "V, F = soup(20_000); k = len(V)\n"
        "S = np.array([[-9., -9, -9], [19, -9, -9], [19, 19, -9], [-9, 19, -9]])\n"
        "v = ll.ViewFactors(np.vstack([V, S, S[::-1] + [0, 0, 28]]),"
        " F.tolist() + [[k, k + 1, k + 2, k + 3], [k + 4, k + 5, k + 6, k + 7]])",
        "v.between(20_000, 20_001, 1e-9)",
    ),
    "from_point": ("v = ll.ViewFactors(*soup(3000))", "v.from_point(rng.random((9000, 3)) * 10, UP)"),
    "sunlit": ("v = ll.ViewFactors(*soup(20_000))", "[v.sunlit(UP) for _ in range(99)]"),
    "visible_polygons": (
        "s = ll.Scene(*soup(100_000))",
        "[s.visible_polygons([5, 5, -5], big) for _ in range(99)]",
    ),
    "fraction": ("s = ll.Scene(*soup(100_000))", "[s.visible_fraction([5, 5, -5], big) for _ in range(999)]"),
    "intervals": (
        "s = ll.Scene(*soup(30_000))",
        "s.visible_intervals(np.zeros((10_000_000, 3)), [[0, 0, 9.], [9, 0, 9]])",
    ),
    "many samples": (
        "s = ll.Scene(*soup(1000))",
        "s.irradiance([[5, 5, -5]] * 50, UP, big, method='point-area', samples=1 << 24)",
    ),
    "lit": ("s = ll.Scene(*soup(100_000))", "s.irradiance([5, 5, -5], UP, [big] * 99, method='hybrid')"),
    "sample": (
        "lamp = ll.Sphere([0, 0, 3], 1.0, 1.0)",
        "ll.sample(lamp, np.zeros((50_000_000, 3)), UP, rng.random((50_000_000, 2), 'f4'))",
    ),
    "obj": (
        "import tempfile, os; path = os.path.join(tempfile.mkdtemp(), 'a.obj')\n"
        "open(path, 'w').write('v 0 0 0\\nv 1 0 0\\nv 0 1 0\\n' + 'f 1 2 3\\n' * 4_000_000)",
        "[ll.render(path, samples=1, resolution=(4, 4)) for _ in range(99)]",
    ),
    "pbrt": (
        "import tempfile, os; path = os.path.join(tempfile.mkdtemp(), 'a.pbrt')\n"
        "text = 'Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" ['\n"
        "open(path, 'w').write('Camera \"perspective\"\\nWorldBegin\\nLightSource \"point\"\\n'"
        " + text + '0 1 2 ' * 3_000_000 + ']\\n')",
        "[ll.render(path, samples=1, resolution=(4, 4)) for _ in range(99)]",
    ),
    "render": ("", "ll.render('cornell-box', samples=100_000, resolution=(2000, 2000))"),
    "one row": ("", "ll.render('cornell-box', samples=1, camera_samples=1_000_000, resolution=(4000, 1))"),
    "converge": ("", "ll.converge('cornell-box', trials=100_000, samples=[1024])"),
    "one thread": ("s = ll.Scene(*soup(3000))", "s.irradiance(np.zeros((9_000_000, 3)), UP, big, threads=1)"),
}


@unix
@pytest.mark.parametrize("name", LONG)
def test_an_interrupt_ends_a_long_call_within_seconds(name):
    before, call = LONG[name]
    code = f"""
import signal, sys, time, numpy as np, linelit as ll
signal.signal(signal.SIGINT, signal.default_int_handler)
rng = np.random.default_rng(0)
UP = [0, 0, 1.]
big = ll.Rectangle([-50, -50, 50], [0, 100, 0], [100, 0, 0], 1.0)
def soup(n):
    middles = rng.random((n, 1, 3)) * 10
    return (middles + rng.normal(size=(n, 3, 3)) * .2).reshape(-1, 3), np.arange(3 * n).reshape(-1, 3)
{before}
print("ready", flush=True)
try:
    {call}
except KeyboardInterrupt:
    print("interrupted", flush=True)
    # What was stopped leaves nothing behind.
    s = ll.Scene([[-.2, -.1, 1], [.25, -.05, 1], [0, .2, 1.1]], [[0, 1, 2]])
    lamp = ll.Rectangle([-.5, -.5, 2], [0, 1, 0], [1, 0, 0], radiance=10.)
    for n in (1, 9000):
        print(set(s.irradiance(np.zeros((n, 3)), UP, lamp, method="exact").round(6).tolist()))
"""
    run = [sys.executable, "-c", code]
    with subprocess.Popen(run, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout.readline() == "ready\n"
        time.sleep(0.7)
        child.send_signal(signal.SIGINT)
        begin = time.monotonic()
        try:
            assert child.stdout.readline() == "interrupted\n"
            took = time.monotonic() - begin
            rest = child.stdout.read()
        finally:
            child.kill()
    assert rest == "{1.738571}\n" * 2
    # It takes about a tenth of a second, but longer on busy machines.
    assert took < 5, took


@unix
def test_a_handler_of_signals_may_ask_for_more():
    code = """
import signal, numpy as np, linelit as ll
s = ll.Scene([[-.2, -.1, 1], [.25, -.05, 1], [0, .2, 1.1]], [[0, 1, 2]])
lamp = ll.Rectangle([-.5, -.5, 2], [0, 1, 0], [1, 0, 0], radiance=10.)
def handle(number, frame):
    found.extend(set(s.irradiance(np.zeros((n, 3)), [0, 0, 1], lamp, method="exact").round(6).tolist()))
for count, samples in ((1, 3_000_000), (1000, 3000)):
    for n in (1, 9000):
        found = []
        signal.signal(signal.SIGALRM, handle)
        signal.setitimer(signal.ITIMER_REAL, 0.05)
        s.irradiance(np.zeros((count, 3)), [0, 0, 1], lamp, method="point-area", samples=samples)
        assert found == [1.738571], found
"""
    subprocess.run([sys.executable, "-c", code], check=True, timeout=300)
