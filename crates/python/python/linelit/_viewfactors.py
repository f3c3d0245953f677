"""The results of the methods of `ViewFactors`."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class Estimate(NamedTuple):
    """A view factor from one facet to another.

    Attributes
    ----------
    value : float
        The factor.
    error : float
        A bound of its error, absolute.
    """

    value: float
    error: float


class PointFactors(NamedTuple):
    """The view factors from points to facets.

    Attributes
    ----------
    facets : ndarray of float64, shape (…, m)
        The factor to each facet.
    sky : ndarray of float64, shape (…)
        1 minus the sum of the factors: the factor to the sky.
    """

    facets: NDArray[np.float64]
    sky: NDArray[np.float64]


class FactorMatrix(NamedTuple):
    """The view factors between all facets, as a sparse matrix in compressed rows.

    Attributes
    ----------
    data : ndarray of float64
        The factors.
    indices : ndarray of int32
        The column of each: the facet that receives.
    indptr : ndarray of int64, shape (m + 1,)
        Row ``i`` is ``data[indptr[i]:indptr[i + 1]]``.
    error : ndarray of float64
        A bound of the error of each factor, absolute.
    sky : ndarray of float64, shape (m,)
        1 minus the sum of each row: the factors to the sky.
    """

    data: NDArray[np.float64]
    indices: NDArray[np.int32]
    indptr: NDArray[np.int64]
    error: NDArray[np.float64]
    sky: NDArray[np.float64]
