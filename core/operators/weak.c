#include "core/operators/weak.h"

#include "core/base/memory.h"
#include "core/cells/volume.h"

/* An entry of S, of the matrices that are wanted. */
static void put(struct gnp_collocation *out, size_t at, size_t column, double stiffness, double mass)
{
	out->column[at] = (uint32_t)column;
	if (out->value[GNP_DERIVATIVE_LAPLACIAN])
		out->value[GNP_DERIVATIVE_LAPLACIAN][at] = -stiffness / mass;
	if (out->value[GNP_DERIVATIVE_STIFFNESS])
		out->value[GNP_DERIVATIVE_STIFFNESS][at] = stiffness;
}

/* Row i at its place; the diagonal among its neighbours. */
static void write_row(const struct gnp_stiffness *s, size_t i, double mass, struct gnp_collocation *out)
{
	size_t at = out->row_offsets[i], e = s->start[i];
	for (; e < s->start[i + 1] && s->column[e] < i; e++, at++)
		put(out, at, s->column[e], -s->value[e], mass);
	put(out, at++, i, s->diagonal[i], mass);
	for (; e < s->start[i + 1]; e++, at++)
		put(out, at, s->column[e], -s->value[e], mass);
	out->row_offsets[i + 1] = at;
}

static gnp_status allocate(size_t count, size_t entries, unsigned which, struct gnp_collocation *out,
                           struct gnp_error *error)
{
	*out = (struct gnp_collocation){.rows = count, .columns = count,
	                                .row_offsets = gnp_array_new(count + 1, sizeof *out->row_offsets),
	                                .column = gnp_array_new(entries, sizeof *out->column),
	                                .kept = gnp_array_new(count, sizeof *out->kept),
	                                .mass = gnp_array_new(count, sizeof *out->mass)};
	bool room = out->row_offsets && out->column && out->kept && out->mass;
	for (int d = 0; d < GNP_DERIVATIVE_COUNT && room; d++)
		if (which & GNP_DERIVATIVE_BIT(d))
			room = (out->value[d] = gnp_array_new(entries, sizeof(double))) != NULL;
	return room ? GNP_OK : gnp_no_memory("laplacian", count, "points", error);
}

static gnp_status make(const struct gnp_domain *domain, const struct gnp_stiffness *stiffness, unsigned which,
                       struct gnp_collocation *out, struct gnp_error *error)
{
	size_t count = domain->prepared.count;
	struct gnp_collocation made;
	gnp_status status = allocate(count, stiffness->start[count] + count, which, &made, error);
	if (status == GNP_OK)
		made.row_offsets[0] = 0;
	for (size_t i = 0; i < count && status == GNP_OK; i++) {
		write_row(stiffness, i, domain->area[i], &made);
		made.kept[i] = (uint32_t)i;
		made.mass[i] = domain->area[i];
	}
	if (status == GNP_OK)
		*out = made;
	else
		gnp_collocation_clear(&made);
	return status;
}

gnp_status gnp_weak_make(const struct gnp_domain *domain, unsigned which, const struct gnp_stiffness *known,
                         struct gnp_pool *pool, struct gnp_task *task, struct gnp_collocation *out,
                         struct gnp_error *error)
{
	struct gnp_stiffness stiffness;
	if (known)
		return make(domain, known, which, out, error);
	gnp_status status = gnp_volume_stiffness(&domain->prepared, pool, task, &stiffness, error);
	if (status != GNP_OK)
		return status;
	status = make(domain, &stiffness, which, out, error);
	gnp_stiffness_clear(&stiffness);
	return status;
}
