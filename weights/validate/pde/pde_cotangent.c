#include "weights/validate/pde/pde_cotangent.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/base/vector.h"

static const double cotangent_most = 1e6;

static double cotangent(const struct gnp_real_mesh *surface, const uint32_t *corner, int c)
{
	const double *o = surface->vertices + 3 * (size_t)corner[c];
	const double *a = surface->vertices + 3 * (size_t)corner[(c + 1) % 3],
				 *b = surface->vertices + 3 * (size_t)corner[(c + 2) % 3];
	double u[3], v[3], across[3];
	for (int d = 0; d < 3; d++) {
		u[d] = a[d] - o[d];
		v[d] = b[d] - o[d];
	}
	gnp_cross(u, v, across);
	double value = gnp_dot(u, v) / sqrt(gnp_dot(across, across));
	return fmin(fmax(value, -cotangent_most), cotangent_most);
}

/* weight (edges) and the form's mass. */
static void measure(const struct gnp_pde_mesh *mesh, double *weight, double *mass)
{
	const struct gnp_real_mesh *surface = &mesh->surface;
	for (size_t t = 0; t < surface->triangle_count; t++) {
		double normal[3], area = gnp_real_mesh_normal(surface, t, normal);
		for (int c = 0; c < 3; c++) {
			weight[mesh->edge_of[3 * t + (size_t)c]] += cotangent(surface, surface->triangles + 3 * t, c) / 2;
			mass[surface->triangles[3 * t + (size_t)c]] += area / 3;
		}
	}
}

/* Edges are ascending by their ends, so that going through them fills the rows in order: first the lower
 * neighbours, then the diagonal, then the higher ones. next: spare (rows). */
static void fill(const struct gnp_pde_mesh *mesh, const double *weight, size_t *next, struct gnp_csr *out)
{
	size_t n = out->rows, *offsets = out->row_offsets;
	for (size_t e = 0; e < 2 * mesh->edge_count; e++)
		offsets[mesh->edge[e] + 1]++;
	for (size_t i = 0; i < n; i++) {
		offsets[i + 1] += offsets[i] + 1;
		next[i] = offsets[i];
	}
	for (size_t e = 0, i = 0; i < n; i++) {
		size_t diagonal = next[i]++; /* all lower neighbours have been: their edges came first */
		out->column[diagonal] = (uint32_t)i;
		for (; e < mesh->edge_count && mesh->edge[2 * e] == i; e++) {
			uint32_t j = mesh->edge[2 * e + 1];
			out->column[next[i]] = j;
			out->value[next[i]++] = -weight[e];
			out->column[next[j]] = (uint32_t)i;
			out->value[next[j]++] = -weight[e];
		}
		out->value[diagonal] = 0;
		for (size_t k = offsets[i]; k < offsets[i + 1]; k++)
			out->value[diagonal] -= k == diagonal ? 0 : out->value[k];
	}
}

gnp_status gnp_pde_cotangent_make(const struct gnp_pde_mesh *mesh, struct gnp_pde_form *out, struct gnp_error *error)
{
	size_t n = mesh->surface.vertex_count;
	struct gnp_pde_form form = {.mass = gnp_array_zero(n, sizeof *form.mass), .points = mesh->surface.vertices};
	double *weight = gnp_array_zero(mesh->edge_count, sizeof *weight);
	size_t *next = gnp_array_new(n, sizeof *next);
	gnp_status status = form.mass && weight && next
	                        ? gnp_csr_allocate(n, n, 2 * mesh->edge_count + n, &form.stiffness, error)
	                        : gnp_no_memory("cotangents", n, "vertices", error);
	if (status == GNP_OK) {
		measure(mesh, weight, form.mass);
		fill(mesh, weight, next, &form.stiffness);
	}
	free(weight);
	free(next);
	if (status == GNP_OK)
		*out = form;
	else
		gnp_pde_form_clear(&form);
	return status;
}
