"""Right values: closed forms, laws, and random points against exact answers."""

import linelit as ll
import numpy as np
import pytest

RNG = np.random.default_rng(7)
NOTHING = ll.Scene([], [])
UP = [0.0, 0.0, 1.0]


def soup(count, seed):
    """Small triangles between the floor and a lamp two up."""
    rng = np.random.default_rng(seed)
    middle = rng.uniform([-1.2, -1.2, 0.4], [1.2, 1.2, 1.6], (count, 1, 3))
    vertices = (middle + rng.uniform(-0.25, 0.25, (count, 3, 3))).reshape(-1, 3)
    return ll.Scene(vertices, np.arange(3 * count).reshape(-1, 3))


LAMP = ll.Rectangle([-1, -1, 2], [0, 2, 0], [2, 0, 0], 3.0)


def test_a_square_over_its_middle():
    # Four times the factor of a quarter of the square over its corner. With x = a / √(a² + c²), for
    # half the side a and the height c, the sum is F = (4/π) x atan(x).
    for half, height in [(1.0, 2.0), (0.5, 3.0), (2.0, 0.25)]:
        lamp = ll.Rectangle([-half, -half, height], [0, 2 * half, 0], [2 * half, 0, 0], 1.0)
        x = half / np.hypot(half, height)
        factor = 4 / np.pi * x * np.arctan(x)
        got = NOTHING.irradiance([0, 0, 0], UP, lamp, method="exact") / np.pi
        # The value has four terms of up to one, with a few roundings each.
        assert got == pytest.approx(factor, abs=1e-14)


def test_round_lights_and_skies_by_their_closed_forms():
    # The factor is sin² of the half angle for a disk over its middle and for a sun, (R / d)² for a
    # sphere, and 1 for a sky.
    lights = {
        ll.Disk([0, 0, 2], [0, 0, -1], 1.0, 1.0): 1 / 5,
        ll.Sphere([0, 0, 2], 0.5, 1.0): 1 / 16,
        ll.Environment(1.0): 1.0,
        ll.Sun([0, 0, 1], 0.3, 1.0): np.sin(0.3) ** 2,
    }
    for light, factor in lights.items():
        each = [NOTHING.irradiance([0, 0, 0], UP, light, seed=k) for k in range(64)]
        mean, error = np.mean(each), np.std(each) / 8
        # Allow five standard errors, and the rounding of a closed form where there is no noise.
        assert abs(mean - np.pi * factor) <= 5 * error + 1e-12
    assert NOTHING.irradiance([0, 0, 0], UP, ll.Distant([0, 1, 1], 2.0)) == pytest.approx(2**0.5)
    assert NOTHING.irradiance([0, 0, 0], UP, ll.Point([0, 0, 2], 8.0)) == pytest.approx(2.0)


def test_methods_agree_past_triangles():
    scene = soup(30, 1)
    points = RNG.uniform([-1, -1, 0], [1, 1, 0.2], (20, 3))
    exact = scene.irradiance(points, UP, LAMP, method="exact")
    fraction = scene.visible_fraction(points, LAMP, measure="cosine", normals=np.tile(UP, (20, 1)))
    open_sky = NOTHING.irradiance(points, UP, LAMP, method="exact")
    # Points are lifted by 1e-14, which moves shadows on the lamp by up to some thousand times that.
    assert np.allclose(exact, fraction * open_sky, rtol=0, atol=1e-10)
    for method in ["hybrid", "line-analytic", "point-solid-angle", "point-area+line-solid-angle"]:
        each = [scene.irradiance(points, UP, LAMP, method=method, seed=k) for k in range(100)]
        mean, error = np.mean(each, axis=0), np.std(each, axis=0, ddof=1) / 10
        # Twenty points and four methods: 5 standard errors are passed in one of 20,000 runs.
        assert (abs(mean - exact) <= 5 * error + 1e-10).all(), method


def test_lights_add_up():
    scene = soup(30, 2)
    points = RNG.uniform([-1, -1, 0], [1, 1, 0.2], (10, 3))
    other = ll.Rectangle([2, -1, 0.5], [0, 2, 0], [0, 0, 1], 5.0)
    both = scene.irradiance(points, UP, [LAMP, other], method="exact")
    alone = [scene.irradiance(points, UP, light, method="exact") for light in (LAMP, other)]
    assert np.allclose(both, sum(alone), rtol=1e-14)


def test_diffuse_radiance_is_irradiance_times_albedo_over_pi():
    scene, up = soup(30, 5), [0, 0, 1]
    points = np.random.default_rng(6).uniform([-1, -1, 0], [1, 1, 0], (3, 20, 3))
    lamp = ll.Rectangle([-1, -1, 2], [0, 2, 0], [2, 0, 0], radiance=4.0)
    irradiance = scene.irradiance(points, up, lamp, method="exact")
    for albedo in 0.5, [0.5, 0.25, 0.125]:
        bsdf = ll.Lambert(albedo)
        found = scene.radiance(points, up, bsdf, [0.3, 0.1, 1.0], lamp, method="exact")
        assert found.shape == points.shape[:2] + np.shape(albedo)
        want = np.multiply.outer(irradiance, albedo) / np.pi
        # Four roundings.
        np.testing.assert_allclose(found, want, rtol=4 * np.finfo(float).eps)
    assert np.ptp(irradiance) > 0.5


def test_a_reflection_for_each_point_and_sums_of_reflections():
    scene, up = soup(30, 7), [0, 0, 1]
    points = np.random.default_rng(8).uniform([-1, -1, 0], [1, 1, 0], (40, 3))
    lamp = ll.Rectangle([-1, -1, 2], [0, 2, 0], [2, 0, 0], radiance=4.0)
    dark, bright = ll.Lambert(0.25), ll.Lambert(0.5)
    radiance = lambda bsdf: scene.radiance(points, up, bsdf, up, lamp, method="exact")
    low, high = radiance(dark), radiance(bright)
    assert np.array_equal(radiance([dark, bright] * 20), np.where(np.arange(40) % 2, high, low))
    # Three roundings each.
    np.testing.assert_allclose(radiance(dark + bright), low + high, rtol=8 * np.finfo(float).eps)


def area(ring):
    """Twice the signed area in the xy plane, halved."""
    x, y = ring[:, 0], ring[:, 1]
    return 0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1))


def test_rings_have_the_visible_area():
    scene = soup(30, 3)
    for point in RNG.uniform([-1, -1, 0], [1, 1, 0.2], (20, 3)):
        rings = scene.visible_polygons(point, LAMP)
        share = scene.visible_fraction(point, LAMP)
        # Corners in space are rounded to 1e-15 of their size; a ring has a hundred at most.
        assert abs(sum(map(area, rings))) / 4 == pytest.approx(share, abs=1e-9)


def test_intervals_are_those_of_the_triangle_in_between():
    # A half plane hides x > 0 of the lamp from the origin.
    scene = ll.Scene([[0, -6, 1], [12, 0, 1], [0, 6, 1]], [[0, 1, 2]])
    lines = [[[-1, 0, 2], [1, 0, 2]], [[-1, 1, 2], [-0.5, 1, 2]], [[1, 0, 2], [0.5, 0, 2]]]
    lo, hi, offsets = scene.visible_intervals([0, 0, 0], lines)
    assert offsets.tolist() == [0, 1, 2, 2]
    assert lo.tolist() == [0, 0] and np.allclose(hi, [0.5, 1.0], atol=1e-15)
    many = scene.visible_intervals(np.zeros((3, 3)), lines)
    one_line = scene.visible_intervals(np.zeros((3, 3)), lines[0])
    assert all(np.array_equal(a, b) for a, b in zip(many, (lo, hi, offsets)))
    assert one_line[2].tolist() == [0, 1, 2, 3]


def test_triangles_in_between():
    vertices = np.array([[-1, -1, 1], [1, -1, 1], [0, 1, 1]])
    stack = np.concatenate([vertices + [0, 0, dz] for dz in (0, 0.5, 2, -3)] + [vertices + [9, 0, 0]])
    scene = ll.Scene(stack, np.arange(15).reshape(-1, 3))
    assert scene.between([0, 0, 0], LAMP).tolist() == [0, 1]
    assert scene.between([0, 0, 0], [[-1, -1, 4], [1, -1, 4], [0, 1, 4]]).tolist() == [0, 1, 2]
    assert scene.between([0, 0, 0], LAMP).dtype == np.uint32


TECHNIQUES = {
    "polygon": (LAMP, ["area", "proxy", "solid-angle", "projected-solid-angle"]),
    "disk": (ll.Disk([0.2, 0, 2], [0, 0.1, -1], 0.7, 1.0), ["area", "solid-angle", "projected-solid-angle"]),
    "sphere": (ll.Sphere([0.3, 0, 2], 0.5, 1.0), ["area", "visible-area", "solid-angle", "projected-solid-angle"]),
    "cylinder": (
        ll.Cylinder([-1, 0, 2], [1, 0.2, 2], 0.2, 1.0),
        ["area", "visible-area", "solid-angle", "projected-solid-angle"],
    ),
    "line": (ll.Line([-1, 0, 2], [1, 0.2, 2], 1.0), ["area", "solid-angle", "projected-solid-angle"]),
}
CASES = [(kind, name) for kind, (_, names) in TECHNIQUES.items() for name in names]


@pytest.mark.parametrize(("kind", "name"), CASES)
def test_samples_have_their_density_and_the_right_mean(kind, name):
    light, _ = TECHNIQUES[kind]
    assert light.kind == kind
    count = 20_000
    xi = np.random.default_rng(11).random(count if kind == "line" else (count, 2))
    x, pdf = ll.sample(light, [0, 0, 0], UP, xi, technique=name)
    drawn = pdf > 0
    again = ll.pdf(light, [0, 0, 0], UP, x[drawn], technique=name)
    assert np.allclose(again, pdf[drawn], rtol=1e-6)
    # The mean of cosine over density is the irradiance of a light of radiance one. Points of a
    # solid that face away have a density per solid angle, too, and do not count.
    direction = x[drawn] / np.linalg.norm(x[drawn], axis=1, keepdims=True)
    if name == "area" and kind in ("sphere", "cylinder"):
        pytest.skip("points on the far side are the caller's to leave out")
    estimates = np.zeros(count)
    estimates[drawn] = np.maximum(direction[:, 2], 0) / pdf[drawn]
    mean, error = estimates.mean(), estimates.std(ddof=1) / count**0.5
    radiance = 3.0 if kind == "polygon" else 1.0
    method = "exact" if kind in ("polygon", "line") else "point-solid-angle"
    each = [NOTHING.irradiance([0, 0, 0], UP, light, method=method, samples=4096, seed=k) for k in range(16)]
    truth, spread = np.mean(each) / radiance, np.std(each, ddof=1) / radiance / 4
    assert abs(mean - truth) <= 5 * np.hypot(error, spread) + 1e-9


def test_an_image_of_a_sky_is_turned():
    image = np.zeros((64, 128, 3))
    image[:8] = 1.0  # around the z axis
    def mean(light, normal):
        return NOTHING.irradiance(np.zeros((1, 3)), normal, light, samples=4096)[0, 0]
    up = ll.Environment(image)
    sideways = ll.Environment(image, to_image=[[0, 1, 0], [0, 0, 1], [1, 0, 0]], scale=2.0)
    assert mean(up, UP) > 0.3 and mean(up, [0, 0, -1]) == 0
    assert mean(sideways, [1, 0, 0]) == pytest.approx(2 * mean(up, UP), rel=0.02)
    assert mean(sideways, [-1, 0, 0]) == 0


def test_a_sky_is_turned_and_mirrored_by_its_matrix():
    # A linear function c + a·w of the direction gives a plane π c + 2π a·n/3 along its normal n.
    theta, phi = (np.arange(128) + 0.5) / 128 * np.pi, (np.arange(256) + 0.5) / 256 * 2 * np.pi
    sine = np.sin(theta)[:, None]
    w = np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)[:, None] + 0 * phi], axis=-1)
    slopes = np.array([[0.7, 0.5, 0.3], [-0.4, 0.2, 0.8], [0.3, -0.9, 0.1]])
    turn = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    for to_image in (np.eye(3), turn, np.diag([-1.0, 1.0, 1.0]) @ turn, turn @ np.diag([1.0, 1.0, -1.0])):
        sky = ll.Environment(2 + w @ slopes.T, to_image=to_image)
        for normal in ([0, 0, 1], [0.6, -0.8, 0], [-0.48, 0.36, -0.8]):
            got = NOTHING.irradiance(np.zeros((1, 3)), normal, sky, samples=4096)[0]
            want = 2 * np.pi + 2 * np.pi / 3 * slopes @ to_image @ np.array(normal)
            # By Sobol points, and a pixel of the image is .02 across; a wrong sign is off by tens of percent.
            assert got == pytest.approx(want, rel=0.01), to_image


def test_surface_offset_lifts_points_of_float32():
    # A slanted triangle hides the lamp from its own points where they are rounded to float32.
    vertices = np.array([[-10, -10, -3], [10, -10, 1], [0, 10, 3.3]], dtype=np.float32)
    weights = RNG.dirichlet([1, 1, 1], 500)
    points = (weights @ vertices.astype(float)).astype(np.float32)
    a, b, c = vertices.astype(float)
    normal = np.cross(b - a, c - a)
    lamp = ll.Rectangle([-1, -1, 20], [0, 2, 0], [2, 0, 0], 1.0)
    lifted = ll.Scene(vertices, [[0, 1, 2]], surface_offset=1e-4)
    plain = ll.Scene(vertices, [[0, 1, 2]])
    dark = [(scene.irradiance(points, normal, lamp, method="exact") == 0).mean() for scene in (lifted, plain)]
    assert dark[0] == 0 and dark[1] > 0.1


def test_scenes_are_the_same_everywhere_on_the_map():
    blade = np.array([[-0.2, -0.1, 1.0], [0.25, -0.05, 1.0], [0.0, 0.2, 1.1]])
    for at in ([0, 0, 0], [5000, 5000, 0], [540000, 0, 0], [500000, 5400000, 300]):
        at = np.array(at, float)
        lamp = ll.Rectangle(np.array([-0.5, -0.5, 2.0]) + at, [0, 1, 0], [1, 0, 0], 10.0)
        # Add a vertex that no face uses. It must not change the rounding of the others.
        scene = ll.Scene(np.vstack([blade + at, [[0, 0, 0]]]), [[0, 1, 2]])
        # Allow half a unit of the last digit of these numbers, and the rounding to float32 of
        # coordinates of about one.
        got = scene.irradiance(at, UP, lamp, method="exact")
        assert got == pytest.approx(1.738571, abs=6e-7)
        assert scene.visible_fraction(at, lamp) == pytest.approx(0.766364, abs=6e-7)


def test_points_on_rounded_faces_see_the_light():
    floor = np.array([[-1.1, -0.9, 0.1], [1.3, -0.7, 0.3], [0.1, 1.7, -0.1]])
    scene = ll.Scene(floor, [[0, 1, 2]])
    weights = RNG.dirichlet([1, 1, 1], 200)
    normal = np.cross(floor[1] - floor[0], floor[2] - floor[0])
    got = scene.irradiance(weights @ floor, normal, LAMP, method="exact")
    want = NOTHING.irradiance(weights @ floor, normal, LAMP, method="exact")
    # The points are lifted by three roundings of vertices, at a distance of two from the lamp.
    assert np.allclose(got, want, rtol=1e-6, atol=0)


def test_details_that_rounding_loses_are_warned_about():
    small = [[0.1, 0, 0], [0.7, 0, 0], [0.1, 0.3, 0]]
    far = [[4e6, 1e6, 0.1], [4e6, 1e6 + 0.3, 0.1], [4e6 + 0.6, 1e6, 0.1]]
    with pytest.warns(UserWarning, match="single precision") as caught:
        ll.Scene(small + far, [[0, 1, 2], [3, 4, 5]])
    assert len(caught) == 1
