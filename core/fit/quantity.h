/* The table of geometric quantities: names, shapes and meaning, the single source for masks, outputs and documents.
 *
 * In Monge form sigma(u, v) = o + u psi1 + v psi2 + h(u, v) psi3 with (u, v, h) in the caller's length unit; (psi1,
 * psi2, psi3) is right-handed and psi3 points outward. Derivative indices are (u, v) = (0, 1). Tensors are row-major.
 */
#ifndef GNP_CORE_QUANTITY_H
#define GNP_CORE_QUANTITY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* enumerator, name, rank of one item, its first two extents (a rank-3 item is 2x2x2), help with the unit.
 * A width of 0 marks surface_coefficients, whose width is the basis size. */
#define GNP_QUANTITY_TABLE(X)                                                                                        \
	X(GNP_POINTS, "points", 1, 3, 1, 3, "the point moved onto the fitted surface along psi3 [length]")               \
	X(GNP_NORMALS, "normals", 1, 3, 1, 3, "outward unit normal")                                                     \
	X(GNP_TANGENTS, "tangents", 2, 2, 3, 6, "sigma_u and sigma_v as vectors in space")                               \
	X(GNP_METRIC, "metric", 2, 2, 2, 4, "first fundamental form g_ij")                                               \
	X(GNP_INVERSE_METRIC, "inverse_metric", 2, 2, 2, 4, "inverse metric g^ij")                                       \
	X(GNP_METRIC_DETERMINANT, "metric_determinant", 0, 1, 1, 1, "det g")                                             \
	X(GNP_INVERSE_METRIC_DERIVATIVES, "inverse_metric_derivatives", 3, 2, 2, 8, "d_k g^ij, k first [1/length]")      \
	X(GNP_SECOND_FUNDAMENTAL_FORM, "second_fundamental_form", 2, 2, 2, 4, "II_ij = sigma_ij . n [1/length]")         \
	X(GNP_SHAPE_OPERATOR, "shape_operator", 2, 2, 2, 4, "Weingarten map I^-1 II [1/length]")                         \
	X(GNP_GAUSSIAN_CURVATURE, "gaussian_curvature", 0, 1, 1, 1, "K = det W [1/length^2]")                            \
	X(GNP_MEAN_CURVATURE, "mean_curvature", 0, 1, 1, 1, "H = tr W / 2, -1/R on a sphere [1/length]")                 \
	X(GNP_PRINCIPAL_CURVATURES, "principal_curvatures", 1, 2, 1, 2, "k1 >= k2, eigenvalues of W [1/length]")         \
	X(GNP_PRINCIPAL_DIRECTIONS, "principal_directions", 2, 2, 3, 6, "unit vectors in space for k1 and k2")           \
	X(GNP_SURFACE_COEFFICIENTS, "surface_coefficients", 1, 0, 1, 0, "coefficients of h/scale[1] in the basis of the fit") \
	X(GNP_FRAME, "frame", 2, 3, 3, 9, "rows psi1, psi2, psi3 of the patch")                                          \
	X(GNP_ORIGIN, "origin", 1, 3, 1, 3, "o, the mean of the patch [length]")                                         \
	X(GNP_SCALE, "scale", 1, 2, 1, 2, "lengths that (u, v) and h are divided by in the patch [length]")              \
	X(GNP_RESIDUAL, "residual", 0, 1, 1, 1, "root mean square of the heights' misfit over the patch [length]")       \
	X(GNP_DEVIATION, "deviation", 0, 1, 1, 1,                                                                        \
	  "how far the point is off the surface along psi3, over max(2 std, delta0) of the patch's heights")             \
	X(GNP_POINTS_STDERR, "points_stderr", 0, 1, 1, 1, "standard error of the height of points [length]")             \
	X(GNP_NORMALS_STDERR, "normals_stderr", 0, 1, 1, 1, "standard error of the normal's direction [radian]")         \
	X(GNP_GAUSSIAN_CURVATURE_STDERR, "gaussian_curvature_stderr", 0, 1, 1, 1, "standard error of K [1/length^2]")    \
	X(GNP_MEAN_CURVATURE_STDERR, "mean_curvature_stderr", 0, 1, 1, 1, "standard error of H [1/length]")              \
	X(GNP_PRINCIPAL_CURVATURES_STDERR, "principal_curvatures_stderr", 1, 2, 1, 2, "standard errors of k1, k2 [1/length]") \
	X(GNP_OUTLIER, "outlier", 0, 1, 1, 1,                                                                            \
	  "1 where the point does not lie on its neighbours' surface (adaptive; gnp with weights auto or any, or where it " \
	  "leaves outliers out)")                                                                                        \
	X(GNP_BOUNDARY, "boundary", 0, 1, 1, 1,                                                          \
	  "1 where the cloud ends: the point is within about a spacing of its rim")                                       \
	X(GNP_CREASE, "crease", 0, 1, 1, 1,                                                                              \
	  "1 where the point is within about a spacing of an edge between smooth pieces, a rim or a tip (gnp with weights " \
	  "auto or any)")

enum gnp_quantity {
#define GNP_QUANTITY_ENUM(id, name, rank, rows, columns, width, help) id,
	GNP_QUANTITY_TABLE(GNP_QUANTITY_ENUM)
#undef GNP_QUANTITY_ENUM
	GNP_QUANTITY_COUNT
};

struct gnp_quantity_info {
	const char *name, *help;
	unsigned rank;      /* of one point's value: 0 scalar, 1 vector, ... */
	size_t shape[3];    /* its extents, the first `rank` of them; 0 means the basis size */
	size_t width;       /* their product; 0 means the basis size */
};

/* The row of a quantity; NULL past the last. */
const struct gnp_quantity_info *gnp_quantity_info(enum gnp_quantity quantity);

/* Sets *quantity by name; false when there is none. length: bytes of name, which need not be NUL-terminated. */
bool gnp_quantity_find(const char *name, size_t length, enum gnp_quantity *quantity);

#define GNP_QUANTITY_BIT(quantity) (UINT64_C(1) << (quantity))
/* Those only an estimator with error bars has, and those only one that judges outliers has. */
#define GNP_QUANTITY_STDERR                                                                                \
	(GNP_QUANTITY_BIT(GNP_POINTS_STDERR) | GNP_QUANTITY_BIT(GNP_NORMALS_STDERR) |                          \
	 GNP_QUANTITY_BIT(GNP_GAUSSIAN_CURVATURE_STDERR) | GNP_QUANTITY_BIT(GNP_MEAN_CURVATURE_STDERR) |       \
	 GNP_QUANTITY_BIT(GNP_PRINCIPAL_CURVATURES_STDERR))
#define GNP_QUANTITY_ALL (GNP_QUANTITY_BIT(GNP_QUANTITY_COUNT) - 1)

#endif
