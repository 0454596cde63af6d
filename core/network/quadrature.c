#include "core/network/quadrature.h"

#include <math.h>

size_t gnp_quadrature_choose(const float *nodes, size_t stride, size_t count, size_t wanted, size_t *chosen,
                             float *distance)
{
	if (wanted >= count) {
		for (size_t i = 0; i < count; i++)
			chosen[i] = i;
		return count;
	}
	for (size_t i = 0; i < count; i++)
		distance[i] = INFINITY;
	for (size_t k = 0, latest = 0; k < wanted; k++) {
		const float u = nodes[latest * stride], v = nodes[latest * stride + 1];
		float farthest = -2;
		size_t next = 0;
		chosen[k] = latest;
		distance[latest] = -1;
		for (size_t i = 0; i < count; i++) {
			float du = nodes[i * stride] - u, dv = nodes[i * stride + 1] - v, d = du * du + dv * dv;
			if (d < distance[i])
				distance[i] = d;
			if (distance[i] > farthest) {
				farthest = distance[i];
				next = i;
			}
		}
		latest = next;
	}
	return wanted;
}
