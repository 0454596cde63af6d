/* Eigenvalues and eigenvectors of symmetric matrices of fixed small size. */
#ifndef GNP_CORE_EIGEN_H
#define GNP_CORE_EIGEN_H

/* a: the upper triangle (xx, xy, xz, yy, yz, zz). values descending, vectors[i] the unit eigenvector of values[i], the
 * three right-handed (v0 x v1 = v2). Cyclic Jacobi: accurate to a few units in the last place of the largest
 * eigenvalue, at any scale, for any multiplicity. */
void gnp_eigen_symmetric3(const double a[6], double values[3], double vectors[3][3]);

#endif
