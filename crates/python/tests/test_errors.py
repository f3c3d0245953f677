"""Wrong input: each has its message, with the argument, the index and the value.

``python tests/test_errors.py`` prints the table.
"""

import linelit as ll
import numpy as np
import pytest

FLOOR = np.zeros((2, 3))
UP = np.array([0.0, 0.0, 1.0])
VERTICES = np.array([[-1.0, -1, 1], [1, -1, 1], [0, 1, 1]])
FACES = np.array([[0, 1, 2]])
SCENE = ll.Scene(VERTICES, FACES)
SQUARE = np.array([[0.0, 0, 2], [0, 1, 2], [1, 1, 2], [1, 0, 2]])
LAMP = ll.Polygon(SQUARE, 1.0)
LINE = ll.Line([0, 0, 2], [1, 0, 2], 1.0)
DISK = ll.Disk([0, 0, 2], [0, 0, -1], 1.0, 1.0)
BALL = ll.Sphere([0, 0, 2], 0.5, 1.0)
SUN = ll.Sun([0, 0, 1], 0.01, 1.0)
SKY = ll.Environment(1.0)
VIEWS = ll.ViewFactors(VERTICES, FACES)
NAN = np.array([[0.0, 0, 0], [np.nan, 0, 1]])


def irradiance(points=FLOOR, normals=UP, light=LAMP, **options):
    return SCENE.irradiance(points, normals, light, **options)


def radiance(bsdf=ll.Lambert(0.5), points=FLOOR, normals=UP, outgoing=UP, **options):
    return SCENE.radiance(points, normals, bsdf, outgoing, LAMP, **options)


def fraction(points=FLOOR, light=LAMP, **options):
    return SCENE.visible_fraction(points, light, **options)


def sample(xi, light=LAMP, points=FLOOR, normals=UP, **options):
    return ll.sample(light, points, normals, xi, **options)


def with_vertex(i, value):
    vertices = VERTICES.copy()
    vertices[i] = value
    return ll.Scene(vertices, FACES)


# What is called, the kind of error, and words of its message.
WRONG = [
    (lambda: radiance(0.5), TypeError, "needs a linelit.Reflection"),
    (lambda: radiance([ll.Lambert(0.5)]), ValueError, "1 reflections for 2 points"),
    (lambda: radiance(outgoing=np.zeros((3, 3))), ValueError, "outgoing (3,)"),
    (lambda: radiance(outgoing=[UP, np.zeros(3)]), ValueError, "outgoing direction 1 is zero"),
    (lambda: radiance(normals=[UP, np.zeros(3)]), ValueError, "normals[1]"),
    (lambda: radiance(points=NAN), ValueError, "points[1]"),
    (lambda: ll.Lambert(-0.5), ValueError, "albedo is negative"),
    (lambda: ll.Lambert([0.5, 0.5]), ValueError, "albedo has the shape (2,)"),
    (lambda: ll.OrenNayar(0.5, 120), ValueError, "sigma is 120 degrees"),
    (lambda: ll.Phong(0.5, 0.5, -1), ValueError, "exponent is -1"),
    (lambda: ll.Phong(0.5, np.nan, 1), ValueError, "specular is negative or not finite"),
    (lambda: ll.Metal(0.2, 3.9, 0.0), ValueError, "alpha is 0"),
    (lambda: ll.Metal(0.2, 3.9, [0.1, 0.2]), ValueError, "need a tangent"),
    (lambda: ll.Metal(0.2, 3.9, [0.1, 0.2, 0.3]), ValueError, "alpha has the shape (3,)"),
    (lambda: ll.Plastic(0.5, 0.5, 0.1, eta=0), ValueError, "eta is 0"),
    (lambda: ll.Substrate(0.5, 0.5, 0.1, tangent=[0, 0, 0]), ValueError, "tangent is zero"),
    (lambda: ll.Frostbite(0.5, 0.5, 2), ValueError, "roughness is 2"),
    (lambda: ll.Lambert(0.5) + 1, TypeError, ""),
    (lambda: ll.Scene(VERTICES[:, :2], FACES), ValueError, "vertices has the shape (3, 2)"),
    (lambda: ll.Scene(VERTICES[0], FACES), ValueError, "vertices are () vectors"),
    (lambda: ll.Scene("mesh.obj", FACES), TypeError, "vertices is 'mesh.obj'"),
    (lambda: ll.Scene(None, FACES), TypeError, "vertices is None"),
    (lambda: ll.Scene(VERTICES.astype(complex), FACES), TypeError, "complex128"),
    (lambda: ll.Scene(VERTICES > 0, FACES), TypeError, "the type bool"),
    (lambda: ll.Scene(VERTICES.astype(object), FACES), TypeError, "the type object"),
    (lambda: ll.Scene([[0, 0, 0], [1, 2]], FACES), ValueError, "vertices: "),
    (lambda: ll.Scene(np.ma.array(VERTICES, mask=False), FACES), TypeError, "masked array"),
    (lambda: with_vertex(1, np.nan), ValueError, "vertices[1]"),
    (lambda: with_vertex(2, np.inf), ValueError, "vertices[2]"),
    (lambda: with_vertex(0, 1e300), ValueError, "vertices[0]"),
    (lambda: ll.Scene(VERTICES, [[0, 1, 3]]), ValueError, "faces[0] has vertex 3"),
    (lambda: ll.Scene(VERTICES, [[0, 1, -1]]), ValueError, "faces[0] has the vertex -1"),
    (lambda: ll.Scene(VERTICES, np.array([[0, 1, -2]], "i4")), ValueError, "the vertex -2"),
    (lambda: ll.Scene(VERTICES, [[0, 1, 2**40]]), ValueError, "the vertex 1099511627776"),
    (lambda: ll.Scene(VERTICES, [[0, 1, 2, 0]]), ValueError, "faces has the shape (1, 4)"),
    (lambda: ll.Scene(VERTICES, [0, 1, 2]), ValueError, "faces has the shape (3,)"),
    (lambda: ll.Scene(VERTICES, [[0.0, 1.0, 2.0]]), TypeError, "faces has the type float64"),
    (lambda: ll.Scene(VERTICES, FACES, surface_offset=-1.0), ValueError, "surface_offset"),
    (lambda: ll.Scene(VERTICES, FACES, light_margin=np.nan), ValueError, "light_margin"),
    (lambda: ll.Scene(VERTICES, FACES, threads=0), ValueError, "threads is 0"),
    (lambda: ll.Polygon(SQUARE[:2], 1.0), ValueError, "corners: "),
    (lambda: ll.Polygon(np.tile(SQUARE, (5, 1)), 1.0), ValueError, "corners: "),
    (lambda: ll.Polygon(SQUARE + [[0, 0, 0.5], [0] * 3, [0] * 3, [0] * 3], 1.0), ValueError, "corners: "),
    (lambda: ll.Polygon(SQUARE[[0, 2, 1, 3]], 1.0), ValueError, "corners: "),
    (lambda: ll.Polygon(SQUARE * np.nan, 1.0), ValueError, "corners: "),
    (lambda: ll.Polygon(SQUARE[None], 1.0), ValueError, "corners are (1, 4) vectors"),
    (lambda: ll.Polygon(SQUARE, [1.0, 2.0]), ValueError, "radiance has the shape (2,)"),
    (lambda: ll.Polygon(SQUARE, -1.0), ValueError, "radiance is negative"),
    (lambda: ll.Polygon(SQUARE, np.nan), ValueError, "radiance is negative or not finite: nan"),
    (lambda: ll.Polygon(SQUARE, "bright"), TypeError, "radiance is 'bright'"),
    (lambda: ll.Rectangle([0, 0, 0], [1, 0, 0], [2, 0, 0], 1.0), ValueError, "corner, u, v"),
    (lambda: ll.Rectangle([0, 0], [1, 0, 0], [0, 1, 0], 1.0), ValueError, "corner has the shape (2,)"),
    (lambda: ll.Disk([0, 0, 0], [0, 0, 0], 1.0, 1.0), ValueError, "normal is zero"),
    (lambda: ll.Disk([0, 0, 0], UP, -1.0, 1.0), ValueError, "radius is -1"),
    (lambda: ll.Sphere([0, 0, np.inf], 1.0, 1.0), ValueError, "center is not finite"),
    (lambda: ll.Sphere([0, 0, 0], 0.0, 1.0), ValueError, "radius is 0"),
    (lambda: ll.Cylinder([0, 0, 0], [0, 0, 0], 1.0, 1.0), ValueError, "start and end"),
    (lambda: ll.Line([0, 0, 0], [0, 0, 0], 1.0), ValueError, "start and end"),
    (lambda: ll.Spot([0, 0, 0], UP, 1.0, 0.5, 1.0), ValueError, "inner is 1 and outer 0.5"),
    (lambda: ll.Distant([0, 0, 0], 1.0), ValueError, "direction is zero"),
    (lambda: ll.Sun(UP, 0.0, 1.0), ValueError, "half_angle is 0"),
    (lambda: ll.Environment(np.zeros((4, 8))), ValueError, "image has the shape (4, 8)"),
    (lambda: ll.Environment(-np.ones((4, 8, 3))), ValueError, "image: "),
    (lambda: ll.Environment(np.ones((4, 8, 3)), to_image=2 * np.eye(3)), ValueError, "image: "),
    (lambda: irradiance(points=np.zeros((2, 2))), ValueError, "points has the shape (2, 2)"),
    (lambda: irradiance(points=NAN), ValueError, "points[1] is not finite, or beyond 2^60: [NaN, 0, 1]"),
    (lambda: irradiance(normals=np.zeros((2, 3))), ValueError, "normals[0] is zero"),
    (lambda: irradiance(normals=NAN), ValueError, "normals[0] is zero"),
    (lambda: irradiance(normals=np.ones((3, 3))), ValueError, "points are (2,) vectors, normals (3,)"),
    (lambda: irradiance(light=None), TypeError, "light is <class 'NoneType'>"),
    (lambda: irradiance(light=[LAMP, 1.0]), TypeError, "light is <class 'float'>"),
    (lambda: irradiance(method="best"), ValueError, 'method="best"'),
    (lambda: irradiance(method="exact", light=DISK), ValueError, "light 0, a disk"),
    (lambda: irradiance(method="exact", light=[LAMP, BALL]), ValueError, "light 1, a sphere"),
    (lambda: irradiance(method="exact", light=SUN), ValueError, "light 0, a environment"),
    (lambda: irradiance(method="exact", light=SKY), ValueError, 'method="hybrid"'),
    (lambda: irradiance(samples=0), ValueError, "samples is 0"),
    (lambda: irradiance(samples=-1), OverflowError, "samples is -1, and needs 0 to 4294967295"),
    (lambda: irradiance(seed=-1), OverflowError, "seed is -1, and needs 0 to 18446744073709551615"),
    (lambda: irradiance(seed=2**64), OverflowError, "seed is 18446744073709551616"),
    (lambda: ll.render("cornell-box", seed=-1), OverflowError, "seed is -1"),
    (lambda: ll.render("cornell-box", bounces=-2), OverflowError, "bounces is -2"),
    (lambda: ll.render("cornell-box", resolution=(-1, 4)), OverflowError, "resolution is -1"),
    (lambda: ll.converge("cornell-box", seed=-1), OverflowError, "seed is -1"),
    (lambda: ll.converge("cornell-box", samples=[-4, 4]), OverflowError, "samples is -4"),
    (lambda: ll.converge("cornell-box", samples=[]), ValueError, "samples are []"),
    (lambda: ll.converge([]), ValueError, "need one each"),
    (lambda: ll.Polygon([], 1.0), ValueError, "corners: "),
    (lambda: ll.Environment(1.0, scale=-1.0), ValueError, "scale is negative"),
    (lambda: SCENE.between([], SQUARE), ValueError, "point has the shape (0,)"),
    (lambda: irradiance(sampler="magic"), ValueError, "sampler: "),
    (lambda: irradiance(threads=-1), OverflowError, ""),
    (lambda: fraction(measure="size"), ValueError, 'measure is "size"'),
    (lambda: fraction(measure="cosine"), ValueError, "needs normals"),
    (lambda: fraction(normals=UP), ValueError, "takes no normals"),
    (lambda: fraction(light=SKY), ValueError, "no exact answer"),
    (lambda: fraction(light=ll.Cylinder([0, 0, 2], [1, 0, 2], 0.1, 1.0)), ValueError, "no exact answer"),
    (lambda: fraction(light=ll.Sphere([0, 0, 1.3], 0.5, 1.0)), ValueError, "a triangle reaches into light 0"),
    (lambda: fraction(light=LINE, measure="solid-angle"), ValueError, "no exact answer"),
    (lambda: fraction(light=[LAMP, LAMP]), ValueError, "a list of 2"),
    (lambda: fraction(points=NAN), ValueError, "points[1]"),
    (lambda: SCENE.visible_polygons(FLOOR[:, :2], LAMP), ValueError, "point has the shape (2, 2)"),
    (lambda: SCENE.visible_polygons(NAN, LAMP), ValueError, "point[1] is not finite"),
    (lambda: SCENE.visible_polygons(NAN[1], LAMP), ValueError, "point[0] is not finite"),
    (lambda: SCENE.visible_polygons(FLOOR[0], LINE), ValueError, "no exact answer"),
    (lambda: SCENE.visible_intervals(FLOOR, SQUARE[:3]), ValueError, "lines need the shape"),
    (lambda: SCENE.visible_intervals(FLOOR, np.ones((3, 2, 3))), ValueError, "points are (2,)"),
    (lambda: SCENE.visible_intervals(NAN, np.ones((2, 2, 3))), ValueError, "points[1] = [NaN"),
    (lambda: SCENE.between(FLOOR[0], DISK), TypeError, "polygon is a disk"),
    (lambda: SCENE.between(FLOOR[0], SQUARE[:2]), ValueError, "polygon: "),
    (lambda: SCENE.between(NAN[1], SQUARE), ValueError, "point is not finite"),
    (lambda: sample([0.5, 1.0]), ValueError, "xi[0] is 1"),
    (lambda: sample([[0.1, 0.2, 0.3]]), ValueError, "xi has the shape (1, 3)"),
    (lambda: sample(np.ones((3, 2)) / 2), ValueError, "points are (2,), normals () and xi (3,)"),
    (lambda: sample([0.5, 0.5], light=SKY), ValueError, "no surface"),
    (lambda: sample([0.5, 0.5], technique="luck"), ValueError, 'technique is "luck"'),
    (lambda: sample([0.5, 0.5], light=DISK, technique="proxy"), ValueError, "for a disk"),
    (lambda: sample([0.5, 0.5], points=NAN), ValueError, "points[1] is not finite"),
    (lambda: ll.pdf(LAMP, FLOOR, UP, NAN), ValueError, "x[1] is not finite"),
    (lambda: ll.render("nowhere.pbrt"), FileNotFoundError, "nowhere.pbrt"),
    (lambda: ll.render("cornell-bx"), ValueError, "did you mean"),
    (lambda: ll.render("cornell-box", estimator="best"), ValueError, 'estimator="best"'),
    (lambda: ll.render("cornell-box", resolution=(0, 4)), ValueError, "resolution is (0, 4)"),
    (lambda: ll.render("cornell-box", samples=0), ValueError, "at least 1"),
    (lambda: ll.converge("cornell-box", ["best"]), ValueError, 'estimators="best"'),
    (lambda: ll.converge("cornell-box", []), ValueError, "one each at least"),
    (lambda: ll.converge("cornell-box", samples=[4, 1]), ValueError, "need to ascend"),
    (lambda: ll.converge("cornell-box", trials=1), ValueError, "trials is 1"),
    (lambda: ll.converge("cornell-box", pixels="many"), ValueError, 'pixels="many"'),
    (lambda: ll.from_trimesh("mesh"), TypeError, "needs to be a trimesh"),
    (lambda: ll.from_mitsuba([1]), TypeError, "shape 0 is <class 'int'>"),
    (lambda: ll.ViewFactors(VERTICES[:, :2], FACES), ValueError, "vertices has the shape (3, 2)"),
    (lambda: ll.ViewFactors(VERTICES[0], FACES), ValueError, "vertices are () vectors"),
    (lambda: ll.ViewFactors(NAN, FACES), ValueError, "vertices[1] is not finite, or beyond 2^60"),
    (lambda: ll.ViewFactors(VERTICES * 1e300, FACES), ValueError, "vertices[0] is not finite"),
    (lambda: ll.ViewFactors(VERTICES, FACES, 3), ValueError, "sides is 3"),
    (lambda: ll.ViewFactors(VERTICES, FACES, "both"), TypeError, ""),
    (lambda: ll.ViewFactors(VERTICES, np.array([0, 1, 2])), ValueError, "polygons has the shape (3,)"),
    (lambda: ll.ViewFactors(VERTICES, FACES[None]), ValueError, "polygons has the shape (1, 1, 3)"),
    (lambda: ll.ViewFactors(VERTICES, np.array([[0, 1, -1]])), ValueError, "polygons[0] has the vertex -1"),
    (lambda: ll.ViewFactors(VERTICES, FACES * 1.0), TypeError, "polygons has the type float64"),
    (lambda: ll.ViewFactors(VERTICES, None), TypeError, "polygons is None"),
    (lambda: ll.ViewFactors(VERTICES, [[0, 1, 2], [0, 1, 2, 3]]), ValueError, "polygons[1] has vertex 3, but"),
    (lambda: ll.ViewFactors(VERTICES, [[0, 1, 2], [0, -1, 2]]), ValueError, "polygons[1][1] has the vertex -1"),
    (lambda: ll.ViewFactors(VERTICES, [[0, 1, 2], 0]), ValueError, "polygons[1] has the shape ()"),
    (lambda: ll.ViewFactors(VERTICES, [[0, 1, 2], [0.5, 1, 2]]), TypeError, "polygons[1] has the type float64"),
    (lambda: ll.ViewFactors(VERTICES, [[0, 1, 2], [0, 1]]), ValueError, "polygons[1] has no area"),
    (lambda: ll.ViewFactors(VERTICES, [[0, 1, 1]]), ValueError, "polygons[0] has no area"),
    (lambda: ll.ViewFactors(SQUARE + np.diag([0, 0, 1, 0])[:, :3], [[0, 1, 2, 3]]), ValueError, "not flat"),
    (lambda: VIEWS.between(0, 1), ValueError, "j is 1, but there are 1 facets"),
    (lambda: VIEWS.between(-1, 0), ValueError, "i is -1"),
    (lambda: VIEWS.between(0, 0, tolerance=0.0), ValueError, "tolerance is 0"),
    (lambda: VIEWS.between(0, 0, tolerance=np.nan), ValueError, "tolerance is NaN"),
    (lambda: VIEWS.matrix(-1e-4), ValueError, "tolerance is -0.0001"),
    (lambda: VIEWS.matrix(np.inf), ValueError, "tolerance is inf"),
    (lambda: VIEWS.matrix(threads=0), ValueError, "threads is 0"),
    (lambda: VIEWS.from_point([0, 0], UP), ValueError, "points has the shape (2,)"),
    (lambda: VIEWS.from_point(NAN, UP), ValueError, "points[1] is not finite, or beyond 2^60: [NaN"),
    (lambda: VIEWS.from_point(FLOOR, 0 * UP), ValueError, "normals[0] is zero or not finite"),
    (lambda: VIEWS.from_point(FLOOR, np.ones((3, 3))), ValueError, "points are (2,) vectors, normals (3,)"),
    (lambda: VIEWS.sunlit([0, 0, 0]), ValueError, "direction[0] is zero or not finite: [0, 0, 0]"),
    (lambda: VIEWS.sunlit(NAN + UP), ValueError, "direction[1] is zero or not finite: [NaN"),
    (lambda: VIEWS.sunlit([0, 1]), ValueError, "direction has the shape (2,)"),
    (lambda: VIEWS.sunlit(UP, 1), ValueError, "i is 1, but"),
    (lambda: VIEWS.sunlit(UP, threads=2000), ValueError, "threads is 2000"),
    (lambda: ll.Light(), TypeError, ""),
]


def refused(call):
    """The error of a call; what is no `Exception` passes, such as a panic."""
    with pytest.raises(Exception) as caught:
        call()
    return caught.value


@pytest.mark.parametrize("case", range(len(WRONG)))
def test_wrong_input_is_told_apart(case):
    call, kind, words = WRONG[case]
    error = refused(call)
    assert type(error) is kind, (type(error), error)
    assert words in str(error)
    assert str(error) == "" or len(str(error)) < 400


def test_a_scene_file_that_is_broken_is_told_with_its_position(tmp_path):
    file = tmp_path / "broken.pbrt"
    file.write_text("WorldBegin\nShape \"sphere\" \"float radius\" [ nothing ]\n")
    with pytest.raises(ValueError, match="broken.pbrt:2"):
        ll.render(file)


if __name__ == "__main__":
    for call, kind, _ in WRONG:
        print(f"{kind.__name__}: {refused(call)}")
