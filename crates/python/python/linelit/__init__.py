"""Direct illumination with exact visibility.

A scene is a set of triangles that cast shadows. Its methods compute how much light reaches points
from a polygon, a line, a sphere or a sky, which part of a light the points see, and which triangles
are in between. All arrays are numpy's. Lengths may be in any unit, and so may radiance.

>>> import linelit as ll
>>> scene = ll.Scene([[-0.2, -0.1, 1.0], [0.25, -0.05, 1.0], [0.0, 0.2, 1.1]], [[0, 1, 2]])
>>> lamp = ll.Rectangle([-0.5, -0.5, 2.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], radiance=10.0)
>>> float(round(scene.irradiance([0.0, 0.0, 0.0], [0.0, 0.0, 1.0], lamp, method="exact"), 6))
1.738571
>>> float(round(scene.visible_fraction([0.0, 0.0, 0.0], lamp), 6))
0.766364
"""

from linelit._linelit import Light, Reflection, Scene, ViewFactors, __version__, pdf, sample
from linelit._files import Picture, Study, converge, render
from linelit._meshes import from_mitsuba, from_trimesh
from linelit._viewfactors import Estimate, FactorMatrix, PointFactors

Polygon = Light.polygon
Rectangle = Light.rectangle
Disk = Light.disk
Sphere = Light.sphere
Cylinder = Light.cylinder
Line = Light.line
Point = Light.point
Spot = Light.spot
Distant = Light.distant
Sun = Light.sun
Environment = Light.environment
Lambert = Reflection.lambert
OrenNayar = Reflection.oren_nayar
Phong = Reflection.phong
Metal = Reflection.metal
Plastic = Reflection.plastic
Microfacet = Reflection.microfacet
Substrate = Reflection.substrate
Frostbite = Reflection.frostbite

__all__ = [
    "Cylinder",
    "Disk",
    "Distant",
    "Environment",
    "Estimate",
    "FactorMatrix",
    "Frostbite",
    "Lambert",
    "Light",
    "Line",
    "Metal",
    "Microfacet",
    "OrenNayar",
    "Phong",
    "Picture",
    "Plastic",
    "Point",
    "PointFactors",
    "Polygon",
    "Rectangle",
    "Reflection",
    "Scene",
    "Sphere",
    "Spot",
    "Study",
    "Substrate",
    "Sun",
    "ViewFactors",
    "__version__",
    "converge",
    "from_mitsuba",
    "from_trimesh",
    "pdf",
    "render",
    "sample",
]
