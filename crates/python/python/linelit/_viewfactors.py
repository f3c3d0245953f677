"""What `ViewFactors` answers."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class Estimate(NamedTuple):
    """A view factor from a facet to another.

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
        The rest to 1, which no facet takes.
    """

    facets: NDArray[np.float64]
    sky: NDArray[np.float64]


class FactorMatrix(NamedTuple):
    """The view factors between all facets that are not zero, row after row.

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
        The rest of each row to 1, which no facet receives.
    """

    data: NDArray[np.float64]
    indices: NDArray[np.int32]
    indptr: NDArray[np.int64]
    error: NDArray[np.float64]
    sky: NDArray[np.float64]
