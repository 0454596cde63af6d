/* What a struct gnp_geodesic holds, for the files that make fronts go out from its points. */
#ifndef GNP_CORE_GEODESIC_PARTS_H
#define GNP_CORE_GEODESIC_PARTS_H

#include "core/cells/fans.h"
#include "core/operators/domain.h"

#define GNP_GEODESIC_DROPPED UINT32_MAX

struct gnp_geodesic {
	struct gnp_domain domain;
	struct gnp_fans shared; /* the triangles, at all their corners */
	uint32_t *place;        /* (cloud's points) in curve order; GNP_GEODESIC_DROPPED: by the filter */
	double longest;         /* edge [length] */
};

#endif
