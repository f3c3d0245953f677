from typing import Any, Callable, Sequence, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from linelit._viewfactors import Estimate, FactorMatrix, PointFactors

__version__: str

Lights: TypeAlias = Light | Sequence[Light]
Reflections: TypeAlias = Reflection | Sequence[Reflection]

class Light:
    @property
    def kind(self) -> str: ...
    @property
    def power(self) -> float: ...
    @staticmethod
    def polygon(corners: ArrayLike, radiance: ArrayLike, *, two_sided: bool = False) -> Light: ...
    @staticmethod
    def rectangle(
        corner: ArrayLike, u: ArrayLike, v: ArrayLike, radiance: ArrayLike, *, two_sided: bool = False
    ) -> Light: ...
    @staticmethod
    def disk(
        center: ArrayLike, normal: ArrayLike, radius: float, radiance: ArrayLike, *, two_sided: bool = False
    ) -> Light: ...
    @staticmethod
    def sphere(center: ArrayLike, radius: float, radiance: ArrayLike) -> Light: ...
    @staticmethod
    def cylinder(start: ArrayLike, end: ArrayLike, radius: float, radiance: ArrayLike) -> Light: ...
    @staticmethod
    def line(start: ArrayLike, end: ArrayLike, radiance_radius: ArrayLike) -> Light: ...
    @staticmethod
    def point(position: ArrayLike, intensity: ArrayLike) -> Light: ...
    @staticmethod
    def spot(
        position: ArrayLike, direction: ArrayLike, inner: float, outer: float, intensity: ArrayLike
    ) -> Light: ...
    @staticmethod
    def distant(direction: ArrayLike, irradiance: ArrayLike) -> Light: ...
    @staticmethod
    def sun(direction: ArrayLike, half_angle: float, radiance: ArrayLike) -> Light: ...
    @staticmethod
    def environment(
        image: ArrayLike, *, scale: ArrayLike | None = None, to_image: ArrayLike | None = None
    ) -> Light: ...

class Reflection:
    @staticmethod
    def lambert(albedo: ArrayLike) -> Reflection: ...
    @staticmethod
    def oren_nayar(albedo: ArrayLike, sigma: float) -> Reflection: ...
    @staticmethod
    def phong(diffuse: ArrayLike, specular: ArrayLike, exponent: float) -> Reflection: ...
    @staticmethod
    def metal(
        eta: ArrayLike, k: ArrayLike, alpha: ArrayLike, *, tangent: ArrayLike | None = None
    ) -> Reflection: ...
    @staticmethod
    def plastic(
        diffuse: ArrayLike,
        specular: ArrayLike,
        alpha: ArrayLike,
        *,
        eta: float = 1.5,
        tangent: ArrayLike | None = None,
    ) -> Reflection: ...
    @staticmethod
    def microfacet(f0: ArrayLike, alpha: ArrayLike, *, tangent: ArrayLike | None = None) -> Reflection: ...
    @staticmethod
    def substrate(
        diffuse: ArrayLike, specular: ArrayLike, alpha: ArrayLike, *, tangent: ArrayLike | None = None
    ) -> Reflection: ...
    @staticmethod
    def frostbite(diffuse: ArrayLike, f0: ArrayLike, roughness: float) -> Reflection: ...
    def __add__(self, other: Reflection) -> Reflection: ...

class Scene:
    def __new__(
        cls,
        vertices: ArrayLike,
        faces: ArrayLike,
        *,
        surface_offset: float | None = None,
        light_margin: float | None = None,
        threads: int | None = None,
    ) -> Scene: ...
    @property
    def face_count(self) -> int: ...
    @property
    def memory(self) -> int: ...
    def irradiance(
        self,
        points: ArrayLike,
        normals: ArrayLike,
        light: Lights,
        *,
        method: str = "hybrid",
        samples: int = 16,
        seed: int = 0,
        sampler: str = "auto",
        threads: int | None = None,
    ) -> NDArray[np.float64]: ...
    def radiance(
        self,
        points: ArrayLike,
        normals: ArrayLike,
        bsdf: Reflections,
        outgoing: ArrayLike,
        light: Lights,
        *,
        method: str = "hybrid",
        samples: int = 16,
        seed: int = 0,
        sampler: str = "auto",
        threads: int | None = None,
    ) -> NDArray[np.float64]: ...
    def visible_fraction(
        self,
        points: ArrayLike,
        light: Lights,
        *,
        measure: str = "area",
        normals: ArrayLike | None = None,
        threads: int | None = None,
    ) -> NDArray[np.float64]: ...
    def visible_polygons(
        self, point: ArrayLike, light: Lights, *, threads: int | None = None
    ) -> list[Any]: ...
    def visible_intervals(
        self, points: ArrayLike, lines: ArrayLike, *, threads: int | None = None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]: ...
    def between(self, point: ArrayLike, polygon: Light | ArrayLike) -> NDArray[np.uint32]: ...

class ViewFactors:
    def __new__(
        cls, vertices: ArrayLike, polygons: ArrayLike | Sequence[Sequence[int]], sides: int = 1
    ) -> ViewFactors: ...
    @property
    def area(self) -> NDArray[np.float64]: ...
    @property
    def displacement(self) -> float: ...
    def __len__(self) -> int: ...
    def between(self, i: int, j: int, tolerance: float = 1e-4) -> Estimate: ...
    def from_point(
        self, points: ArrayLike, normals: ArrayLike, *, threads: int | None = None
    ) -> PointFactors: ...
    def matrix(self, tolerance: float = 1e-4, *, threads: int | None = None) -> FactorMatrix: ...
    def sunlit(
        self, direction: ArrayLike, i: int | None = None, *, threads: int | None = None
    ) -> NDArray[np.float64]: ...

def sample(
    light: Light,
    points: ArrayLike,
    normals: ArrayLike,
    xi: ArrayLike,
    *,
    technique: str = "projected-solid-angle",
) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
def pdf(
    light: Light,
    points: ArrayLike,
    normals: ArrayLike,
    x: ArrayLike,
    *,
    technique: str = "projected-solid-angle",
) -> NDArray[np.float64]: ...
def render(
    scene: str,
    *,
    estimator: str = "hybrid",
    samples: int = 16,
    camera_samples: int = 1,
    resolution: tuple[int, int] | None = None,
    sampler: str = "auto",
    lights: str = "all",
    seed: int = 0,
    bounces: int = 0,
    show_lights: bool = True,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> tuple[NDArray[np.float32], dict[str, Any]]: ...
def converge(
    scenes: list[str],
    *,
    estimators: list[str],
    samplers: list[str],
    samples: list[int],
    trials: int = 16,
    pixels: str = "64x64",
    seed: int = 1,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> list[tuple[str, str]]: ...
