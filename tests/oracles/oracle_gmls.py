#!/usr/bin/python3
"""An independent implementation of the paper's GMLS in numpy, slow and plain: writes tests/oracles/data/gmls_parity.npz, which
test_parity compares with ours. Run it by hand (`tests/oracles/oracle_gmls.py tests/oracles/data/gmls_parity.npz`) when the definition changes.

For every point x of a jittered quarter of a torus (open at both ends): the patch is all points within 1.1 r_k of x, r_k the distance to the k-th nearest,
x itself counted; origin at its mean, axes from its covariance, the third to the side of the mean given normal; in-plane coordinates
divided by the largest in-plane distance; heights fitted by weighted least squares (weight (1-r)^4) on the tensor products of Legendre
polynomials up to degree 3, by orthogonal factorisation; normal and curvatures of that graph where x lies."""
import sys

import numpy as np
from numpy.polynomial import legendre

N, K, DEGREE, SEED = 400, 30, 3, 20240607
RING, TUBE = 1.0, 0.45


def quarter_torus():
    random = np.random.default_rng(SEED)
    i = np.arange(N)
    a = np.pi / 2 * ((i + 0.5) / N + 0.004 * random.standard_normal(N))
    share = np.mod(i * (np.sqrt(5) - 1) / 2 + 0.02 * random.standard_normal(N), 1)
    grid = np.linspace(0, 2 * np.pi, 4001)  # equal areas: the inside of the tube is shorter
    b = np.interp(share * 2 * np.pi * RING, RING * grid + TUBE * np.sin(grid), grid)
    normals = np.stack([np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)], 1)
    points = RING * np.stack([np.cos(a), np.sin(a), 0 * a], 1) + TUBE * normals
    lengths = random.uniform(0.5, 2, N)  # given normals may have any length
    return points + [10, -20, 5], normals * lengths[:, None]


def patch_of(points, normals, centre):
    distance = np.linalg.norm(points - points[centre], axis=1)
    inside = np.flatnonzero(distance <= 1.1 * np.sort(distance)[K - 1])
    origin = points[inside].mean(0)
    centred = points[inside] - origin
    axes = np.linalg.svd(centred, full_matrices=False)[2]
    unit = normals[inside] / np.linalg.norm(normals[inside], axis=1)[:, None]
    if axes[2] @ unit.mean(0) < 0:
        axes[2] = -axes[2]
    if np.linalg.det(axes) < 0:
        axes[1] = -axes[1]
    local = centred @ axes.T
    scale = np.hypot(local[:, 0], local[:, 1]).max()
    return origin, axes, scale, local, (points[centre] - origin) @ axes.T


def fit(local, scale):
    u, v, height = local[:, 0] / scale, local[:, 1] / scale, local[:, 2]
    weight = (1 - np.hypot(u, v)).clip(0) ** 4
    root = np.sqrt(weight)
    phi = legendre.legvander2d(u, v, [DEGREE, DEGREE])
    coefficients = np.linalg.lstsq(phi * root[:, None], height * root, rcond=None)[0]
    misfit = height - phi @ coefficients
    return coefficients.reshape(DEGREE + 1, DEGREE + 1), np.sqrt((weight * misfit ** 2).sum() / weight.sum())


def derivative(coefficients, du, dv, u, v, scale):
    c = legendre.legder(coefficients, du, axis=0) if du else coefficients
    c = legendre.legder(c, dv, axis=1) if dv else c
    return legendre.legval2d(u, v, c) / scale ** (du + dv)


def geometry(points, normals, centre):
    origin, axes, scale, local, at = patch_of(points, normals, centre)
    coefficients, residual = fit(local, scale)
    u, v = at[0] / scale, at[1] / scale
    h, hu, hv, huu, huv, hvv = (derivative(coefficients, i, j, u, v, scale)
                                for i, j in ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)))
    first = np.array([[1 + hu * hu, hu * hv], [hu * hv, 1 + hv * hv]])
    second = np.array([[huu, huv], [huv, hvv]]) / np.sqrt(np.linalg.det(first))
    shape = np.linalg.solve(first, second)
    normal = np.array([-hu, -hv, 1]) @ axes
    return {"expected_points": origin + np.array([at[0], at[1], h]) @ axes, "expected_normals": normal / np.linalg.norm(normal),
            "gaussian_curvature": np.linalg.det(shape), "mean_curvature": np.trace(shape) / 2,
            "metric_determinant": np.linalg.det(first), "residual": residual}


def main(path):
    points, normals = quarter_torus()
    rows = [geometry(points, normals, i) for i in range(N)]
    np.savez(path, points=points, normals=normals, **{name: np.array([row[name] for row in rows]) for name in rows[0]})


if __name__ == "__main__":
    main(sys.argv[1])
