import copy
import pickle
import unittest

import numpy as np

import kinespace
from kinespace import FunctionalPCA

POINTS = 60


def curves(n=40, noise=0.0, points=POINTS):
    """Curves of three smooth functions about a mean."""
    draw = np.random.default_rng(7)
    t = np.linspace(0, 1, points)
    of = np.stack([np.sin(2 * np.pi * t), np.cos(2 * np.pi * t), t * t])
    return 5 + t + (draw.normal(size=(n, 3)) * [3, 1, 0.3]) @ of + noise * draw.normal(size=(n, points))


def trapezoid(points, length=1.0):
    weights = np.full(points, length / (points - 1))
    weights[[0, -1]] /= 2
    return weights


def by_svd(X, weights):
    """Variances and functions of the weighted problem, from the singular values of the curves and not from their covariance."""
    _, s, v = np.linalg.svd((X - X.mean(0)) * np.sqrt(weights) / np.sqrt(len(X) - 1), full_matrices=False)
    return s**2, v / np.sqrt(weights)


class FunctionalPcaTest(unittest.TestCase):
    def test_components_are_those_of_the_svd(self):
        X = curves(noise=0.1)
        for domain in ((0.0, 1.0), (2.0, 7.0)):
            weights = trapezoid(POINTS, domain[1] - domain[0])
            variances, functions = by_svd(X, weights)
            pca = FunctionalPCA(5, domain=domain).fit(X)
            np.testing.assert_allclose(pca.weights_, weights, rtol=1e-12)
            np.testing.assert_allclose(pca.mean_, X.mean(0), rtol=1e-12)
            np.testing.assert_allclose(pca.explained_variance_, variances[:5], rtol=1e-9)
            np.testing.assert_allclose(pca.explained_variance_ratio_, variances[:5] / variances.sum(), rtol=1e-9)
            signs = np.sign((pca.components_ * functions[:5]).sum(1))
            np.testing.assert_allclose(pca.components_, signs[:, None] * functions[:5], atol=1e-6)
            np.testing.assert_allclose((pca.components_ * weights) @ pca.components_.T, np.eye(5), atol=1e-10)

    def test_scores_are_integrals_and_have_those_variances(self):
        X = curves(noise=0.1)
        pca = FunctionalPCA(4)
        scores = pca.fit_transform(X)
        np.testing.assert_allclose(scores, ((X - X.mean(0)) * trapezoid(POINTS)) @ pca.components_.T, atol=1e-10)
        np.testing.assert_allclose(scores.var(axis=0, ddof=1), pca.explained_variance_, rtol=1e-9)
        np.testing.assert_array_equal(pca.transform(X), scores)

    def test_all_components_give_the_curves_back(self):
        X = curves(n=12, noise=0.1)
        pca = FunctionalPCA().fit(X)
        self.assertEqual(pca.n_components_, 11)
        self.assertAlmostEqual(pca.explained_variance_ratio_.sum(), 1)
        np.testing.assert_allclose(pca.inverse_transform(pca.transform(X)), X, atol=1e-8)

    def test_what_is_left_out_is_the_sum_of_squared_scores(self):
        X = curves(noise=0.1)
        few, all_ = FunctionalPCA(2).fit(X), FunctionalPCA().fit(X)
        left = ((X - few.inverse_transform(few.transform(X))) ** 2) @ trapezoid(POINTS)
        np.testing.assert_allclose(left, (all_.transform(X)[:, 2:] ** 2).sum(1), atol=1e-8)

    def test_a_share_takes_the_fewest_that_reach_it(self):
        X = curves(noise=0.1)
        reached = np.cumsum(FunctionalPCA().fit(X).explained_variance_ratio_)
        for share in (0.5, 0.9, 0.99, 0.999):
            self.assertEqual(FunctionalPCA(share).fit(X).n_components_, int((reached < share).sum()) + 1)

    def test_smoothing_finds_the_functions_under_the_noise(self):
        noise = 0.8
        clean, noisy = curves(n=200), curves(n=200, noise=noise)
        of = FunctionalPCA(3).fit(clean).components_

        def distances(components):
            return [min(((c - sign * f) ** 2).sum() for sign in (1, -1)) for c, f in zip(components, of)]

        rough, smooth = (distances(FunctionalPCA(3, smoothing=s).fit(noisy).components_) for s in (None, 0.1))
        for of_smooth, of_rough in zip(smooth, rough):
            self.assertLess(of_smooth, 0.5 * of_rough)
        smoothed = FunctionalPCA(3, smoothing=0.1).fit(noisy)
        self.assertAlmostEqual(smoothed.noise_variance_, noise**2, delta=0.1 * noise**2)
        self.assertIsNone(FunctionalPCA(3).fit(noisy).noise_variance_)

    def test_components_are_views_of_the_fit(self):
        pca = FunctionalPCA(3).fit(curves())
        for array in (pca.components_, pca.mean_, pca.explained_variance_):
            self.assertFalse(array.flags.owndata)
            self.assertTrue(array.flags.c_contiguous)
        kept, components = pca.components_.copy(), pca.components_
        del pca
        np.testing.assert_array_equal(components, kept)

    def test_input_of_any_layout_gives_the_same(self):
        X = np.round(curves(), 3)
        of = FunctionalPCA(3).fit(X).components_
        for same in (np.asfortranarray(X), np.repeat(X, 2, axis=1)[:, ::2], X.tolist(), X.astype(">f8")):
            np.testing.assert_array_equal(FunctionalPCA(3).fit(same).components_, of)

    def test_large_numbers_are_finite(self):
        X = curves(points=4) * 1e306
        with self.assertRaisesRegex(ValueError, "finite"):
            FunctionalPCA(1).fit(np.where(X == X.max(), np.inf, X))
        FunctionalPCA(1).fit(X / 1e200)
        transformed = FunctionalPCA(1).fit(curves(points=4)).inverse_transform(np.full((4, 1), 1e308))
        self.assertEqual(transformed.shape, (4, 4))

    def test_input_is_left_as_it_was(self):
        X = curves()
        before = X.copy()
        FunctionalPCA(3).fit_transform(X)
        np.testing.assert_array_equal(X, before)

    def test_bad_curves_are_value_errors(self):
        good = curves()
        nan, infinite = good.copy(), good.copy()
        nan[3, 4], infinite[0, 0] = np.nan, np.inf
        for bad in (nan, infinite, good[0], good[:1], good[:, :0], good[None], good + 1j, [["a", "b"]] * 3):
            with self.assertRaises(ValueError):
                FunctionalPCA(1).fit(bad)
        with self.assertRaisesRegex(ValueError, "nan in row 3, column 4"):
            FunctionalPCA(1).fit(nan)
        pca = FunctionalPCA(2).fit(good)
        for call, bad in ((pca.transform, nan), (pca.transform, good[:, 1:]), (pca.inverse_transform, np.ones((2, 3)))):
            with self.assertRaises(ValueError):
                call(bad)

    def test_bad_parameters_are_value_errors_of_fit(self):
        X = curves(n=10)
        for bad in (0, -1, 11, 0.0, 1.5, True, "many"):
            with self.assertRaisesRegex(ValueError, "n_components"):
                FunctionalPCA(bad).fit(X)
        for bad in (0.0, 11.0, float("nan")):
            with self.assertRaises(ValueError):
                FunctionalPCA(2, smoothing=bad).fit(X)
        with self.assertRaises(ValueError):
            FunctionalPCA(2, domain=(1.0, 1.0)).fit(X)

    def test_unfitted_use_is_an_error(self):
        for call in (FunctionalPCA().transform, FunctionalPCA().inverse_transform):
            with self.assertRaises(kinespace.NotFittedError):
                call(curves())

    def test_parameters_as_scikit_learn_has_them(self):
        pca = FunctionalPCA(3, smoothing=0.2)
        self.assertEqual(pca.get_params(), {"n_components": 3, "smoothing": 0.2, "domain": (0.0, 1.0)})
        self.assertEqual(FunctionalPCA(**pca.get_params()).get_params(), pca.get_params())
        self.assertIs(pca.set_params(n_components=4), pca)
        self.assertEqual(repr(pca), "FunctionalPCA(n_components=4, smoothing=0.2)")
        with self.assertRaisesRegex(ValueError, "no parameter other"):
            pca.set_params(n_components=7, other=1)
        self.assertEqual(pca.n_components, 4)
        self.assertIs(pca.fit(curves()), pca)

    def test_fits_survive_pickle_and_copies(self):
        X = curves()
        pca = FunctionalPCA(3).fit(X)
        for other in (pickle.loads(pickle.dumps(pca)), copy.deepcopy(pca)):
            np.testing.assert_array_equal(other.transform(X), pca.transform(X))
