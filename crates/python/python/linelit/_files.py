"""Pictures of scene files, and convergence studies of them."""

from __future__ import annotations

import csv
import importlib
import io
import os
from typing import TYPE_CHECKING, Any, Callable, NamedTuple, Sequence

import numpy as np

from linelit import _linelit

if TYPE_CHECKING:
    from numpy.typing import NDArray

Progress = Callable[[int, int], object]


class Picture(NamedTuple):
    """A rendered picture.

    Attributes
    ----------
    pixels : ndarray of float32, shape (height, width, 3)
        Radiance in linear RGB, first row first.
    metadata : dict
        The estimator, the sampling pattern, the numbers of samples, the seed, and the numbers of
        rays, lines and shafts (queries of all triangles between a point and a light).
    """

    pixels: NDArray[np.float32]
    metadata: dict[str, Any]


class Study(dict[str, "NDArray[Any]"]):
    """The measurements of a convergence study: a dict of columns, each an array.

    The columns are those of ``results.csv``, one row for each scene, estimator, sampling pattern
    and number of samples.

    Attributes
    ----------
    slopes : dict of ndarray
        The columns of ``slopes.csv``: the order of convergence of each estimator.
    json : str
        The text of ``results.json``, with all settings.
    """

    slopes: dict[str, NDArray[Any]]
    json: str

    def to_pandas(self) -> Any:
        """Return the measurements as a ``pandas.DataFrame``; needs pandas."""
        return importlib.import_module("pandas").DataFrame(dict(self))


def render(
    scene: str | os.PathLike[str],
    estimator: str = "hybrid",
    samples: int = 16,
    *,
    camera_samples: int = 1,
    resolution: tuple[int, int] | None = None,
    sampler: str = "auto",
    lights: str = "all",
    seed: int = 0,
    bounces: int = 0,
    show_lights: bool = True,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Picture:
    """Render a scene file with direct illumination.

    Parameters
    ----------
    scene : str or path
        A file of pbrt, glTF, OBJ or PLY, or the name of a built-in scene such as ``cornell-box``.
    estimator : str
        ``hybrid``, ``exact``, ``line-analytic``, ``point-solid-angle`` and so on, as
        ``linelit list estimators`` prints them.
    samples : int
        The number of samples for each shading point and light.
    camera_samples : int
        The number of camera rays for each pixel; a single one goes through its centre.
    resolution : (int, int), optional
        Width and height; the default is the resolution in the file.
    sampler, lights : str
        The sampling pattern, and how lights are chosen, by the names that the program uses.
    seed : int
        Two seeds give independent noise.
    bounces : int
        The number of perfect reflections and refractions by which camera rays are followed.
    show_lights : bool
        Whether lights that the camera sees show their radiance.
    threads : int, optional
        The number of threads; the default is one for each core. The picture does not depend on it.
    progress : callable, optional
        Called with the number of rows that are done, and the number of all rows.

    Returns
    -------
    Picture
        The pixels, the settings, and the numbers of rays, lines and shafts.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file is not a valid scene (the message has the position of the error), or an
        argument is not valid.

    Examples
    --------
    >>> import linelit as ll
    >>> picture = ll.render("cornell-box", samples=1, resolution=(32, 32))
    >>> picture.pixels.shape
    (32, 32, 3)
    """
    return Picture(
        *_linelit.render(
            os.fspath(scene),
            estimator=estimator,
            samples=samples,
            camera_samples=camera_samples,
            resolution=resolution,
            sampler=sampler,
            lights=lights,
            seed=seed,
            bounces=bounces,
            show_lights=show_lights,
            threads=threads,
            progress=progress,
        )
    )


def converge(
    scenes: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    estimators: Sequence[str] = ("point-solid-angle", "line-analytic", "exact", "hybrid"),
    *,
    samplers: Sequence[str] = ("stratified",),
    samples: Sequence[int] = (1, 4, 16, 64),
    trials: int = 16,
    pixels: str = "64x64",
    seed: int = 1,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Study:
    """Measure how the error of estimators falls with samples and time.

    Parameters
    ----------
    scenes : str, path, or a sequence of them
        Scene files, or names of built-in scenes.
    estimators, samplers : sequence of str
        Estimators and sampling patterns, by the names that the program uses.
    samples : sequence of int
        Numbers of samples, in ascending order.
    trials : int
        The number of independent trials of each, at least 2.
    pixels : str
        ``WIDTHxHEIGHT`` of the picture whose shading points are measured.
    seed : int
        The seed of the first trial.
    threads : int, optional
        The number of threads; the default is one for each core. Errors do not depend on it, but
        times do.
    progress : callable, optional
        Called with the number of measurements that are done, and the number of all.

    Returns
    -------
    Study
        Columns such as ``scene``, ``estimator``, ``samples``, ``mse`` and ``cpu_seconds``.

    Raises
    ------
    ValueError
        If a name or number is not valid, or a scene has no lights.

    Examples
    --------
    >>> import linelit as ll
    >>> study = ll.converge(
    ...     "cornell-box", ["point-area", "line-analytic"], samples=[1, 4], trials=4, pixels="8x8")
    >>> sorted(set(study["estimator"].tolist()))
    ['line-analytic', 'point-area']
    """
    if isinstance(scenes, (str, os.PathLike)):
        scenes = [scenes]
    tables = dict(
        _linelit.converge(
            [os.fspath(scene) for scene in scenes],
            estimators=list(estimators),
            samplers=list(samplers),
            samples=list(samples),
            trials=trials,
            pixels=pixels,
            seed=seed,
            threads=threads,
            progress=progress,
        )
    )
    study = Study(_columns(tables["results.csv"]))
    study.slopes = _columns(tables["slopes.csv"])
    study.json = tables["results.json"]
    return study


def _columns(text: str) -> dict[str, NDArray[Any]]:
    """Return the columns of a table: numbers if all cells are (NaN if empty), else texts."""
    rows = list(csv.reader(io.StringIO(text)))
    if not rows:
        return {}
    names, rows = rows[0], rows[1:]
    columns = {}
    for k, name in enumerate(names):
        cells = [row[k] for row in rows]
        try:
            columns[name] = np.array([float(cell) if cell else np.nan for cell in cells])
        except ValueError:
            columns[name] = np.array(cells, dtype=np.str_)
            continue
        # Use integers where all cells are integers.
        if cells and all(cell.lstrip("-").isdigit() for cell in cells):
            columns[name] = np.array([int(cell) for cell in cells])
    return columns
