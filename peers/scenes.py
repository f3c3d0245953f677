"""Three diffuse scenes with one area light each, and their files for linelit and Mitsuba.

Triangles are arrays of shape (count, 3, 3): triangle, corner, coordinate.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

RESOLUTION = 256
REFLECTANCE = {
    "white": (0.75, 0.75, 0.75),
    "red": (0.6, 0.06, 0.05),
    "green": (0.12, 0.45, 0.1),
    "grey": (0.5, 0.5, 0.5),
}


@dataclass
class Camera:
    origin: tuple
    target: tuple
    field_of_view: float  # Of the whole (square) picture, in degrees.


@dataclass
class Light:
    """A parallelogram of radiance 1; it shines along the cross product of its sides."""

    corner: tuple
    sides: tuple

    def corners(self):
        corner, first, second = map(np.array, (self.corner, *self.sides))
        return corner, corner + first, corner + first + second, corner + second


@dataclass
class Scene:
    name: str
    meshes: dict  # By the name of their reflectance.
    camera: Camera
    light: Light


def quad(first, second, third, fourth):
    """The two triangles of a quadrilateral, its corners in order around it."""
    return np.array([[first, second, third], [first, third, fourth]], dtype=float)


def box(low, high):
    """The sides of a box between two opposite corners."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    return np.concatenate([
        quad((x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)),
        quad((x0, y1, z0), (x0, y1, z1), (x1, y1, z1), (x1, y1, z0)),
        quad((x0, y0, z0), (x0, y1, z0), (x1, y1, z0), (x1, y0, z0)),
        quad((x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)),
        quad((x0, y0, z0), (x0, y0, z1), (x0, y1, z1), (x0, y1, z0)),
        quad((x1, y0, z0), (x1, y1, z0), (x1, y1, z1), (x1, y0, z1)),
    ])


def surface(points):
    """Triangles between the points of a (rows, columns, 3) grid, without degenerate ones."""
    here, below = points[:-1, :-1], points[1:, :-1]
    right, across = points[:-1, 1:], points[1:, 1:]
    pairs = np.stack(
        [np.stack([here, below, across], -2), np.stack([here, across, right], -2)], 2
    )
    triangles = pairs.reshape(-1, 3, 3)
    first, second = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    return triangles[np.linalg.norm(np.cross(first, second), axis=1) > 1e-12]


def revolve(profile, segments, center, fluting=0.0):
    """A surface of revolution about the vertical line at center = (x, z).

    The profile has (radius, height, fluted) rows; 20 flutes take up to the part `fluting` of the
    radius where `fluted` is 1.
    """
    radius, height, fluted = np.array(profile, dtype=float).T
    angle = np.linspace(0, 2 * np.pi, segments + 1)[:, None]
    radii = radius * (1 - fluting * (0.5 + 0.5 * np.cos(20 * angle)) * fluted)
    heights = np.broadcast_to(height, radii.shape)
    x, z = center
    return surface(
        np.stack([x + radii * np.cos(angle), heights, z + radii * np.sin(angle)], -1)
    )


def cornell():
    """A box with a tilted quadrilateral below its light: 12 triangles."""
    floor = quad((-1, -1, 1), (1, -1, 1), (1, -1, -1), (-1, -1, -1))
    ceiling = quad((-1, 1, -1), (1, 1, -1), (1, 1, 1), (-1, 1, 1))
    back = quad((-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1))
    meshes = {
        "white": np.concatenate([floor, ceiling, back]),
        "red": quad((-1, -1, 1), (-1, -1, -1), (-1, 1, -1), (-1, 1, 1)),
        "green": quad((1, -1, -1), (1, -1, 1), (1, 1, 1), (1, 1, -1)),
        "grey": quad(
            (-0.35, -0.1, -0.25), (-0.35, -0.1, 0.35), (0.25, 0.05, 0.35), (0.25, 0.05, -0.25)
        ),
    }
    camera = Camera((0, 0, 3.5), (0, -0.35, 0), 30)
    light = Light((-0.4, 0.98, -0.4), ((0.8, 0, 0), (0, 0, 0.8)))
    return Scene("cornell", meshes, camera, light)


def grid():
    """Ten times ten small squares over a floor: 202 triangles."""
    size, height = 0.11, 0.3
    middles = (np.arange(10) + 0.5) / 10 * 4 - 2
    squares = [
        quad(
            (x - size, height, z - size),
            (x - size, height, z + size),
            (x + size, height, z + size),
            (x + size, height, z - size),
        )
        for x in middles
        for z in middles
    ]
    floor = quad((-30, 0, 30), (30, 0, 30), (30, 0, -30), (-30, 0, -30))
    meshes = {"white": floor, "grey": np.concatenate(squares)}
    camera = Camera((0.6, 2.3, 4), (0, 0.1, 0.1), 42)
    return Scene("grid", meshes, camera, Light((-1, 3, -1), ((2, 0, 0), (0, 0, 2))))


def colonnade():
    """Two storeys of fluted columns and arches under one opening in the roof: 267,616 triangles."""
    columns = np.linspace(-12, 12, 9)
    white, grey = [uneven_floor(), *walls_and_slabs()], []
    for base in (0.0, 4.1):
        for side in (-1, 1):
            grey += [fluted_column(x, base, side * 3.7) for x in columns]
            grey += [arch(a, b, base, side * 3.7) for a, b in zip(columns, columns[1:])]
    for side in (-1, 1):
        grey += [baluster(x, side * 3.45) for x in np.linspace(-13.6, 13.6, 69)]
        near, far = sorted((side * 3.38, side * 3.52))
        white.append(box((-14, 4.85, near), (14, 4.95, far)))
    banners = [banner(i, x) for i, x in enumerate(np.linspace(-9, 9, 5))]
    meshes = {"white": white, "grey": grey, "red": banners}
    meshes = {name: np.concatenate(parts) for name, parts in meshes.items()}
    camera = Camera((-11.5, 1.7, 0.4), (0, 1.15, -0.4), 40)
    return Scene("colonnade", meshes, camera, Light((-6, 9.5, -2.5), ((12, 0, 0), (0, 0, 5))))


def uneven_floor():
    x, z = np.meshgrid(np.linspace(-14, 14, 111), np.linspace(-7, 7, 61), indexing="ij")
    height = 0.015 * np.maximum(0, np.sin(x * 7)) * np.maximum(0, np.sin(z * 7))
    return surface(np.stack([x, height, z], -1)[:, ::-1])


def walls_and_slabs():
    """The four walls, and the floors and roofs of the galleries on both sides."""
    for z in (-7, 7):
        yield quad((-14, 0, z), (14, 0, z), (14, 8, z), (-14, 8, z))
    for x in (-14, 14):
        yield quad((x, 0, -7), (x, 0, 7), (x, 8, 7), (x, 8, -7))
    for height in (3.9, 7.8):
        yield box((-14, height, -7), (14, height + 0.2, -3.4))
        yield box((-14, height, 3.4), (14, height + 0.2, 7))


def fluted_column(x, base, z):
    top = base + 2.7
    foot = [(0, base, 0), (0.42, base, 0), (0.42, base + 0.12, 0), (0.36, base + 0.2, 0)]
    shaft = [(0.30 - 0.05 * t, base + 0.25 + 2.2 * t, 1) for t in np.linspace(0, 1, 26)]
    capital = [(0.30, top - 0.2, 0), (0.4, top - 0.05, 0), (0.4, top, 0), (0, top, 0)]
    return revolve(foot + shaft + capital, 72, (x, z), fluting=0.12)


def arch(left, right, base, z):
    """A half ring of round section between two columns."""
    middle, radius = (left + right) / 2, (right - left) / 2 - 0.25
    along, around = np.meshgrid(
        np.linspace(0, np.pi, 41), np.linspace(0, 2 * np.pi, 21), indexing="ij"
    )
    distance = radius + 0.18 * np.cos(around)
    rise = min(1.0, 0.95 / radius)
    height = base + 2.7 + distance * np.sin(along) * rise
    return surface(
        np.stack([middle - distance * np.cos(along), height, z + 0.25 * np.sin(around)], -1)
    )


def baluster(x, z):
    profile = [(0.05, 4.1, 0), (0.09, 4.25, 0), (0.05, 4.45, 0), (0.09, 4.65, 0), (0.05, 4.85, 0)]
    return revolve(profile, 12, (x, z))


def banner(number, x):
    """Wavy cloth across the nave."""
    across, down = np.meshgrid(np.linspace(-2.6, 2.6, 61), np.linspace(0, 1, 41), indexing="ij")
    wave = 0.25 * np.sin(3 * across + number) + 0.2 * down * np.sin(5 * across)
    height = 5.6 - 1.2 * down + 0.35 * (across / 2.6) ** 2
    return surface(np.stack([x + wave, height, across], -1))


SCENES = {build.__name__: build for build in (cornell, grid, colonnade)}


def indexed(triangles):
    """Vertices, each once, and the vertex numbers of each triangle."""
    vertices = triangles.reshape(-1, 3).astype("<f4")
    vertices, numbers = np.unique(vertices, axis=0, return_inverse=True)
    return vertices, numbers.reshape(-1, 3).astype("<u4")


def write_ply(path, triangles):
    vertices, numbers = indexed(triangles)
    faces = np.empty(len(numbers), dtype=[("count", "u1"), ("vertices", "<i4", 3)])
    faces["count"], faces["vertices"] = 3, numbers
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(vertices)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    path.write_bytes(header.encode() + vertices.tobytes() + faces.tobytes())


def numbers_of(values):
    return " ".join(f"{value:g}" for value in np.ravel(values))


def write(scene, work):
    """Writes the scene as pbrt text with PLY meshes, and returns the path of the text."""
    folder = Path(work) / scene.name
    folder.mkdir(parents=True, exist_ok=True)
    camera = scene.camera
    lines = [
        "Scale -1 1 1  # The coordinates of the scene are right-handed.",
        f"LookAt {numbers_of(camera.origin)}  {numbers_of(camera.target)}  0 1 0",
        f'Camera "perspective" "float fov" [ {camera.field_of_view} ]',
        f'Film "image" "integer xresolution" [ {RESOLUTION} ]'
        f' "integer yresolution" [ {RESOLUTION} ]',
        'PixelFilter "box" "float xwidth" [ 0.5 ] "float ywidth" [ 0.5 ]',
        "WorldBegin",
    ]
    for name, triangles in scene.meshes.items():
        write_ply(folder / f"{name}.ply", triangles)
        lines += [
            f'Material "matte" "rgb Kd" [ {numbers_of(REFLECTANCE[name])} ]',
            f'Shape "plymesh" "string filename" [ "{name}.ply" ]',
        ]
    lines += [
        'Material "matte" "rgb Kd" [ 0 0 0 ]',
        'AreaLightSource "diffuse" "rgb L" [ 1 1 1 ]',
        'Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]'
        f' "point P" [ {numbers_of(scene.light.corners())} ]',
        "WorldEnd",
    ]
    text = folder / f"{scene.name}.pbrt"
    text.write_text("\n".join(lines) + "\n")
    return text


def for_mitsuba(scene, work):
    """The same scene as Mitsuba's dictionary; `write` must have written its meshes."""
    from mitsuba import ScalarTransform4f as Transform

    camera = scene.camera
    view = Transform().look_at(origin=camera.origin, target=camera.target, up=(0, 1, 0))
    film = {
        "type": "hdrfilm",
        "width": RESOLUTION,
        "height": RESOLUTION,
        "pixel_format": "rgb",
        "component_format": "float32",
        "rfilter": {"type": "box"},
    }
    sensor = {
        "type": "perspective",
        "fov": camera.field_of_view,
        "fov_axis": "x",
        "near_clip": 0.01,
        "far_clip": 1000.0,
        "to_world": view,
        "film": film,
    }
    first, second = np.array(scene.light.sides, dtype=float) / 2
    normal = np.cross(first, second)
    placement = np.eye(4)  # Mitsuba's rectangle spans -1 to 1 in x and y and faces z.
    placement[:3, 0], placement[:3, 1] = first, second
    placement[:3, 2] = normal / np.linalg.norm(normal)
    placement[:3, 3] = np.array(scene.light.corner) + first + second
    light = {
        "type": "rectangle",
        "to_world": Transform(placement),
        "emitter": {"type": "area", "radiance": rgb((1, 1, 1))},
        "bsdf": {"type": "diffuse", "reflectance": rgb((0, 0, 0))},
    }
    described = {"type": "scene", "sensor": sensor, "light": light}
    for name in scene.meshes:
        diffuse = {"type": "diffuse", "reflectance": rgb(REFLECTANCE[name])}
        described[name] = {
            "type": "ply",
            "filename": str(Path(work) / scene.name / f"{name}.ply"),
            "face_normals": True,
            "bsdf": {"type": "twosided", "bsdf": diffuse},
        }
    return described


def rgb(value):
    return {"type": "rgb", "value": list(value)}
