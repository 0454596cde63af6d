/* A function's value and derivatives up to second order at a point of the plane. */
#ifndef GNP_CORE_JET_H
#define GNP_CORE_JET_H

struct gnp_jet {
	double f, u, v, uu, uv, vv;
};

#endif
