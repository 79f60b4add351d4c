"""Functional principal component analysis of any curves, by scikit-learn's conventions and without a need for it."""
from typing import TYPE_CHECKING, Any, Dict, Optional, Tuple, Union

import numpy as np

from . import _kinespace

if TYPE_CHECKING:
    import numpy.typing as npt

    Array = npt.NDArray[np.float64]


class NotFittedError(ValueError, AttributeError):
    """fit has not been called."""


class FunctionalPCA:
    """Finds the orthonormal functions that describe curves with the fewest scores.

    A curve y is near mean_ + sum_k score_k components_[k]. Curves are sampled on one regular grid over `domain`; integrals are trapezoid sums, in which
    the components are orthonormal: scores do not depend on how finely the grid samples the curves, and the squared L2 error of leaving components
    out is the sum of their squared scores.

    Parameters
    ----------
    n_components: how many; a float in (0, 1] is the share of variance that they reach; None keeps all.
    smoothing: None for clean curves. Else mean and covariance are smoothed by local linear fits, the covariance over this share of the domain
        and the mean over half of it, in (0, 10], and the variance of white noise is kept out of the components.
    domain: (start, end) of the grid, in the unit that scores and variances shall have.

    Attributes, after fit
    ---------------------
    components_ [n_components, n_points], mean_ [n_points]: views of the fit's memory.
    explained_variance_ [n_components]: of the scores, descending; explained_variance_ratio_: as shares of all variance.
    weights_ [n_points]: of the trapezoid rule. noise_variance_: float, None without smoothing.
    n_components_, n_samples_, n_features_in_: how many components, curves and points.
    """

    def __init__(
        self,
        n_components: Union[int, float, None] = None,
        *,
        smoothing: Optional[float] = None,
        domain: Tuple[float, float] = (0.0, 1.0),
    ) -> None:
        self.n_components = n_components
        self.smoothing = smoothing
        self.domain = domain

    def fit(self, X: "npt.ArrayLike", y: object = None) -> "FunctionalPCA":
        """Finds the components of X [n_curves, n_points], at least two curves. y is not looked at. ValueError for what is no such array."""
        curves = _numbers(X, "X", "points")
        if curves.shape[0] < 2:
            raise ValueError(f"X: {curves.shape[0]} curve, expected at least 2")
        count, share = self._wanted(*curves.shape)
        try:
            start, end = (float(bound) for bound in self.domain)
            fit = _kinespace.fit_functional_pca(curves, count=count, share=share, smoothing=self.smoothing, start=start, end=end)
        except _kinespace.Error as error:
            if error.kind == "machine":
                raise
            raise ValueError(str(error)) from None
        self.components_ = fit["functions"]
        self.mean_ = fit["mean"]
        self.weights_ = fit["weights"]
        self.explained_variance_ = fit["eigenvalues"]
        self.explained_variance_ratio_ = np.diff(fit["shares"], prepend=0.0)
        self.noise_variance_ = fit["noise_variance"]
        self.n_samples_, self.n_features_in_ = curves.shape
        self.n_components_ = len(self.components_)
        self._projection = fit["projection"]
        return self

    def transform(self, X: "npt.ArrayLike") -> "Array":
        """The scores [n_curves, n_components] of curves: integrals of (X - mean_) with each component."""
        self._require_fitted()
        curves = _numbers(X, "X", "points", self.n_features_in_)
        scores: "Array" = (curves - self.mean_) @ self._projection.T
        return scores

    def fit_transform(self, X: "npt.ArrayLike", y: object = None) -> "Array":
        """fit(X).transform(X)"""
        return self.fit(X).transform(X)

    def inverse_transform(self, X: "npt.ArrayLike") -> "Array":
        """The curves [n_curves, n_points] of scores [n_curves, n_components]."""
        self._require_fitted()
        scores = _numbers(X, "X", "components", self.n_components_)
        curves: "Array" = scores @ self.components_ + self.mean_
        return curves

    def get_params(self, deep: bool = True) -> Dict[str, Any]:
        """The parameters by name. deep: for scikit-learn's sake; no parameter has parameters."""
        return {"n_components": self.n_components, "smoothing": self.smoothing, "domain": self.domain}

    def set_params(self, **params: Any) -> "FunctionalPCA":
        """Sets parameters by name, all or none."""
        for name in params:
            if name not in self.get_params():
                raise ValueError(f"no parameter {name}, expected one of {', '.join(self.get_params())}")
        for name, value in params.items():
            setattr(self, name, value)
        return self

    def __repr__(self) -> str:
        initial = FunctionalPCA().get_params()
        return f"FunctionalPCA({', '.join(f'{k}={v!r}' for k, v in self.get_params().items() if v != initial[k])})"

    def _wanted(self, curves: int, points: int) -> Tuple[Optional[int], float]:
        """How many components, and else the share of variance to reach."""
        wanted, most = self.n_components, min(curves, points)
        if wanted is None:
            return min(curves - 1, points), 1.0
        if isinstance(wanted, (int, np.integer)) and not isinstance(wanted, bool):
            if 1 <= wanted <= most:
                return int(wanted), 1.0
            raise ValueError(f"n_components: {wanted}, expected 1 to {most} of {curves} curves of {points} points")
        if isinstance(wanted, (float, np.floating)) and 0 < wanted <= 1:
            return None, float(wanted)
        raise ValueError(f"n_components: {wanted!r}, expected a count, a share of variance in (0, 1], or None")

    def _require_fitted(self) -> None:
        if not hasattr(self, "components_"):
            raise NotFittedError("this FunctionalPCA is not fitted yet: call fit first")


def _numbers(values: "npt.ArrayLike", name: str, of: str, columns: Optional[int] = None) -> "Array":
    """As a C-ordered array of two dimensions; the same memory where it is one already."""
    given = np.asarray(values)
    if np.iscomplexobj(given):
        raise ValueError(f"{name}: complex numbers, expected real ones")
    try:
        array = np.ascontiguousarray(given, dtype=np.float64)
    except TypeError as error:
        raise ValueError(f"{name}: no array of numbers: {error}") from None
    if given.ndim != 2 or 0 in given.shape:
        raise ValueError(f"{name}: shape {given.shape}, expected [curves, {of}], at least one of each")
    if columns is not None and array.shape[1] != columns:
        raise ValueError(f"{name}: {array.shape[1]} {of}, expected {columns} as in fit")
    # A sum is not finite where a number is not: one quick look, and a second one only then (a sum may overflow).
    with np.errstate(over="ignore", invalid="ignore"):
        suspect = not np.isfinite(array.sum())
    if suspect and not np.isfinite(array).all():
        row, column = np.argwhere(~np.isfinite(array))[0]
        raise ValueError(f"{name}: {array[row, column]} in row {row}, column {column}, expected finite numbers (no NaN, no infinity)")
    return array
