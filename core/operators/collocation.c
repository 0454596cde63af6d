#include "core/operators/collocation.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/cells/cell.h"
#include "core/cloud/patch.h"
#include "core/fit/taylor.h"
#include "core/operators/stencil.h"
#include "core/operators/unfold.h"

enum { POINTS_A_CHUNK = 128 };

const char *gnp_derivative_name(enum gnp_derivative derivative)
{
	static const char *const names[] = {
#define GNP_DERIVATIVE_NAME(id, name) name,
		GNP_DERIVATIVE_TABLE(GNP_DERIVATIVE_NAME)
#undef GNP_DERIVATIVE_NAME
	};
	return derivative < GNP_DERIVATIVE_COUNT ? names[derivative] : NULL;
}

void gnp_collocation_clear(struct gnp_collocation *collocation)
{
	free(collocation->row_offsets);
	free(collocation->column);
	free(collocation->kept);
	free(collocation->mass);
	for (int d = 0; d < GNP_DERIVATIVE_COUNT; d++)
		free(collocation->value[d]);
	*collocation = (struct gnp_collocation){.rows = 0};
}

struct gnp_csr gnp_collocation_view(const struct gnp_collocation *collocation, enum gnp_derivative which)
{
	return (struct gnp_csr){collocation->rows, collocation->columns, collocation->row_offsets, collocation->column,
	                        collocation->value[which]};
}

struct work {
	const struct gnp_prepared *prepared;
	const struct gnp_collocation_rule *rule;
	size_t wide;          /* most entries a row */
	size_t reach;         /* nearest points looked at for them */
	unsigned lowest;      /* degree */
	uint32_t *column_of;  /* (points) of kept ones */
	struct gnp_collocation *out; /* rows of `wide` entries while it is made */
	atomic_size_t reduced;
};

/* The neighbours of one point, and what is known of them. */
struct row {
	size_t count;
	uint32_t *point;          /* (wide) */
	double *u, *v;            /* (wide) */
	double *weights[GNP_STENCIL_PARTS]; /* (wide) each */
	double tangents[2][3];
};

static bool take_row(const struct work *work, struct gnp_scratch *scratch, struct row *row)
{
	bool room = true;
	row->point = gnp_scratch_take(scratch, work->wide, sizeof *row->point);
	row->u = gnp_scratch_take(scratch, work->wide, sizeof(double));
	row->v = gnp_scratch_take(scratch, work->wide, sizeof(double));
	for (int part = 0; part < GNP_STENCIL_PARTS; part++)
		room &= (row->weights[part] = gnp_scratch_take(scratch, work->wide, sizeof(double))) != NULL;
	return room && row->point && row->u && row->v;
}

/* Takes the nearest points of a neighbourhood that are kept and, if one_sheet, of the centre's sheet, by ascending
 * index. */
static void choose_points(const struct work *work, size_t centre, const uint32_t *index, size_t found, bool one_sheet,
                          struct row *row)
{
	const double *normals = work->prepared->normals;
	row->count = 0;
	for (size_t j = 0; j < found && row->count < work->wide; j++) {
		if ((one_sheet && !gnp_same_sheet(normals + 3 * centre, normals + 3 * (size_t)index[j])) ||
		    (work->rule->keep && !work->rule->keep[index[j]]))
			continue;
		size_t at = row->count++;
		for (; at > 0 && row->point[at - 1] > index[j]; at--)
			row->point[at] = row->point[at - 1];
		row->point[at] = index[j];
	}
}

/* Unfolded into the plane tangent at the centre. If no neighbour's normal agrees with the point's, all
 * neighbours are used. */
static void gather(const struct work *work, size_t centre, const uint32_t *index, size_t found, struct row *row)
{
	const struct gnp_prepared *prepared = work->prepared;
	const double *origin = prepared->points + 3 * centre, *normal = prepared->normals + 3 * centre;
	gnp_tangents_of(normal, row->tangents);
	choose_points(work, centre, index, found, true, row);
	if (row->count < 2)
		choose_points(work, centre, index, found, false, row);
	for (size_t j = 0; j < row->count; j++) {
		size_t at = 3 * (size_t)row->point[j];
		gnp_unfold(origin, normal, row->tangents, prepared->points + at, prepared->normals + at, &row->u[j], &row->v[j]);
	}
}

/* The functional of a derivative on the value of the row's j-th point; n is that point's normal. */
static double entry(enum gnp_derivative derivative, const struct row *row, size_t j, const double n[3])
{
	double *const *w = row->weights;
	if (derivative == GNP_DERIVATIVE_VALUE)
		return w[GNP_STENCIL_VALUE][j];
	if (derivative == GNP_DERIVATIVE_LAPLACIAN)
		return w[GNP_STENCIL_UU][j] + w[GNP_STENCIL_VV][j];
	double gradient[3];
	for (int c = 0; c < 3; c++)
		gradient[c] = w[GNP_STENCIL_U][j] * row->tangents[0][c] + w[GNP_STENCIL_V][j] * row->tangents[1][c];
	if (derivative <= GNP_DERIVATIVE_GRADIENT_Z)
		return gradient[derivative - GNP_DERIVATIVE_GRADIENT_X];
	int c = derivative - GNP_DERIVATIVE_DIVERGENCE_X;
	return gradient[c] - gnp_dot(gradient, n) * n[c];
}

static void write_row(struct work *work, size_t centre, const struct row *row)
{
	struct gnp_collocation *out = work->out;
	size_t at = centre * work->wide;
	out->row_offsets[centre + 1] = row->count;
	for (size_t j = 0; j < row->count; j++)
		out->column[at + j] = work->column_of[row->point[j]];
	for (int d = 0; d < GNP_DERIVATIVE_COUNT; d++)
		for (size_t j = 0; out->value[d] && j < row->count; j++)
			out->value[d][at + j] = entry((enum gnp_derivative)d, row, j, work->prepared->normals + 3 * (size_t)row->point[j]);
}

/* Where even the lowest degree is not determined (isolated points, points on a line): the value is the others' mean,
 * the Laplacian that of the graph, first derivatives are none. The system stays regular, and nobody else is any the
 * worse. A centre that carries no unknown has the others' mean for its value and thus no Laplacian. */
static void fall_back(size_t centre, struct row *row)
{
	double square = 0;
	size_t others = 0;
	for (size_t j = 0; j < row->count; j++) {
		square = fmax(square, row->u[j] * row->u[j] + row->v[j] * row->v[j]);
		others += row->point[j] != centre;
	}
	double curvature = others == row->count ? 0 : square > 0 ? 4 / square : 1; /* of the mean over a circle */
	for (size_t j = 0; j < row->count; j++) {
		bool own = row->point[j] == centre;
		double share = own ? 0 : 1 / (double)others;
		for (int part = 0; part < GNP_STENCIL_PARTS; part++)
			row->weights[part][j] = 0;
		row->weights[GNP_STENCIL_VALUE][j] = others ? share : own;
		row->weights[GNP_STENCIL_UU][j] = row->weights[GNP_STENCIL_VV][j] = others ? curvature / 2 * (share - own) : 0;
	}
}

static gnp_status make_row(struct work *work, size_t centre, const uint32_t *index, size_t found, struct row *row,
                           struct gnp_scratch *scratch, struct gnp_error *error)
{
	unsigned used;
	gather(work, centre, index, found, row);
	gnp_status status = gnp_stencil_fit(work->rule->degree, work->lowest, row->u, row->v, row->count, scratch, row->weights,
	                                    &used, NULL);
	if (status == GNP_OUT_OF_MEMORY)
		return gnp_error_set(error, status, "laplacian: no memory for a stencil of %zu points", row->count);
	if (status != GNP_OK)
		fall_back(centre, row);
	if (status != GNP_OK || used < work->rule->degree)
		atomic_fetch_add_explicit(&work->reduced, 1, memory_order_relaxed);
	write_row(work, centre, row);
	return GNP_OK;
}

static gnp_status rows_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                             struct gnp_error *error)
{
	struct work *work = context;
	struct gnp_neighborhoods found;
	struct row row;
	uint32_t centres[POINTS_A_CHUNK];
	for (size_t i = begin; i < end; i++)
		centres[i - begin] = (uint32_t)i;
	gnp_status status = gnp_neighborhoods_find(work->prepared->neighbors, centres, end - begin, work->reach, 1, work->reach,
	                                           scratch, &found, error);
	if (status == GNP_OK && !take_row(work, scratch, &row))
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "laplacian: no memory for a row of %zu", work->wide);
	for (size_t i = 0; i < end - begin && status == GNP_OK; i++) {
		struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
		status = make_row(work, begin + i, found.index + found.start[i], found.start[i + 1] - found.start[i], &row, scratch, error);
		gnp_scratch_release(scratch, mark);
	}
	return status;
}

/* Rows were written `wide` apart: moves them together. */
static void compact(size_t wide, struct gnp_collocation *out)
{
	size_t *offsets = out->row_offsets;
	for (size_t i = 0; i < out->rows; i++)
		offsets[i + 1] += offsets[i];
	for (size_t i = 0; i < out->rows; i++) {
		size_t count = offsets[i + 1] - offsets[i];
		memmove(out->column + offsets[i], out->column + i * wide, count * sizeof *out->column);
		for (int d = 0; d < GNP_DERIVATIVE_COUNT; d++)
			if (out->value[d])
				memmove(out->value[d] + offsets[i], out->value[d] + i * wide, count * sizeof(double));
	}
}

static gnp_status number_columns(const struct gnp_collocation_rule *rule, size_t points, uint32_t *column_of,
                                 struct gnp_collocation *out, struct gnp_error *error)
{
	for (size_t i = 0; i < points; i++) {
		if (rule->keep && !rule->keep[i])
			continue;
		out->kept[out->columns] = (uint32_t)i;
		column_of[i] = (uint32_t)out->columns++;
	}
	if (out->columns == 0)
		return gnp_error_set(error, GNP_DEGENERATE, "points: all %zu are dropped", points);
	return GNP_OK;
}

static gnp_status allocate(const struct gnp_collocation_rule *rule, size_t points, size_t entries,
                           struct gnp_collocation *out, struct gnp_error *error)
{
	out->rows = points;
	out->row_offsets = gnp_array_zero(points + 1, sizeof(size_t));
	out->column = gnp_array_new(entries, sizeof(uint32_t));
	out->kept = gnp_array_new(points, sizeof(uint32_t));
	bool room = out->row_offsets && out->column && out->kept;
	for (int d = 0; d < GNP_DERIVATIVE_COUNT && room; d++)
		if (rule->which & GNP_DERIVATIVE_BIT(d))
			room = (out->value[d] = gnp_array_new(entries, sizeof(double))) != NULL;
	return room ? GNP_OK : gnp_no_memory("laplacian", entries, "entries", error);
}

static gnp_status check_rule(const struct gnp_collocation_rule *rule, unsigned lowest, struct gnp_error *error)
{
	if (rule->degree < lowest || rule->degree > GNP_STENCIL_DEGREE_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "degree: got %u, need %u..%d", rule->degree, lowest, GNP_STENCIL_DEGREE_MAX);
	size_t size = gnp_taylor_size(rule->degree);
	if (rule->neighbors && rule->neighbors < size)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "neighbors: got %zu, need at least %zu for degree %u", rule->neighbors,
		                     size, rule->degree);
	return GNP_OK;
}

static size_t least(size_t a, size_t b)
{
	return a < b ? a : b;
}

gnp_status gnp_collocation_make(const struct gnp_prepared *prepared, const struct gnp_collocation_rule *rule,
                                struct gnp_pool *pool, struct gnp_task *task, struct gnp_collocation *out,
                                struct gnp_error *error)
{
	struct gnp_collocation made = {.rows = 0};
	struct work work = {.prepared = prepared, .rule = rule, .out = &made,
	                    .lowest = rule->which & GNP_DERIVATIVE_BIT(GNP_DERIVATIVE_LAPLACIAN) ? 2 : 1};
	gnp_status status = check_rule(rule, work.lowest, error);
	if (status != GNP_OK)
		return status;
	work.wide = least(rule->neighbors ? rule->neighbors : 2 * gnp_taylor_size(rule->degree), prepared->count);
	work.reach = least(work.wide + work.wide / 3, prepared->count); /* some are dropped or of another sheet */
	work.column_of = gnp_array_new(prepared->count, sizeof *work.column_of);
	status = work.column_of ? allocate(rule, prepared->count, prepared->count * work.wide, &made, error)
	                        : gnp_error_set(error, GNP_OUT_OF_MEMORY, "laplacian: no memory for %zu points", prepared->count);
	if (status == GNP_OK)
		status = number_columns(rule, prepared->count, work.column_of, &made, error);
	if (status == GNP_OK)
		status = gnp_pool_run(pool, task, prepared->count, POINTS_A_CHUNK, rows_chunk, &work, error);
	free(work.column_of);
	if (status != GNP_OK) {
		gnp_collocation_clear(&made);
		return status;
	}
	compact(work.wide, &made);
	made.reduced = work.reduced;
	*out = made;
	return GNP_OK;
}

struct entry {
	uint32_t column;
	uint32_t at; /* in the row before */
};

static int by_column(const void *a, const void *b)
{
	uint32_t x = ((const struct entry *)a)->column, y = ((const struct entry *)b)->column;
	return (x > y) - (x < y);
}

static void move_row(const struct gnp_collocation *from, size_t i, const uint32_t *column_of, struct entry *entries,
                     struct gnp_collocation *to, size_t row)
{
	size_t begin = from->row_offsets[i], count = from->row_offsets[i + 1] - begin, at = to->row_offsets[row];
	for (size_t e = 0; e < count; e++)
		entries[e] = (struct entry){column_of[from->column[begin + e]], (uint32_t)e};
	qsort(entries, count, sizeof *entries, by_column);
	for (size_t e = 0; e < count; e++) {
		to->column[at + e] = entries[e].column;
		for (int d = 0; d < GNP_DERIVATIVE_COUNT; d++)
			if (to->value[d])
				to->value[d][at + e] = from->value[d][begin + entries[e].at];
	}
}

/* The new points of the columns, ascending, and the new column of each old one. spare (points). */
static void move_columns(const struct gnp_collocation *from, const uint32_t *position, size_t points,
                         uint32_t *column_of, uint32_t *spare, struct gnp_collocation *to)
{
	memset(spare, 0xff, points * sizeof *spare);
	for (size_t c = 0; c < from->columns; c++)
		spare[position[from->kept[c]]] = (uint32_t)c;
	for (size_t i = 0; i < points; i++) {
		if (spare[i] == UINT32_MAX)
			continue;
		to->kept[to->columns] = (uint32_t)i;
		if (to->mass)
			to->mass[to->columns] = from->mass[spare[i]];
		column_of[spare[i]] = (uint32_t)to->columns++;
	}
}

static bool has_row(const struct gnp_copy *copy)
{
	return copy->row != GNP_COPY_OUTSIDE;
}

/* Rows that no point became stay empty; copies have those of their originals. */
static void move_rows(const struct gnp_collocation *from, const uint32_t *position, const struct gnp_copies *copies,
                      const uint32_t *column_of, struct entry *entries, struct gnp_collocation *to)
{
	for (size_t i = 0; i < from->rows; i++)
		to->row_offsets[position[i] + 1] = from->row_offsets[i + 1] - from->row_offsets[i];
	for (size_t k = 0; k < copies->count; k++)
		if (has_row(&copies->copy[k]))
			to->row_offsets[copies->copy[k].index + 1] = to->row_offsets[copies->copy[k].original + 1];
	for (size_t i = 0; i < to->rows; i++)
		to->row_offsets[i + 1] += to->row_offsets[i];
	for (size_t i = 0; i < from->rows; i++)
		move_row(from, i, column_of, entries, to, position[i]);
	for (size_t k = 0; k < copies->count; k++)
		if (has_row(&copies->copy[k]))
			move_row(from, copies->copy[k].row, column_of, entries, to, copies->copy[k].index);
	to->reduced = from->reduced;
}

/* Entries of all rows, those of copies among them. */
static size_t count_entries(const struct gnp_collocation *collocation, const struct gnp_copies *copies)
{
	const size_t *offsets = collocation->row_offsets;
	size_t entries = offsets[collocation->rows];
	for (size_t k = 0; k < copies->count; k++)
		if (has_row(&copies->copy[k]))
			entries += offsets[copies->copy[k].row + 1] - offsets[copies->copy[k].row];
	return entries;
}

static size_t longest_row(const struct gnp_collocation *collocation)
{
	size_t longest = 0;
	for (size_t i = 0; i < collocation->rows; i++) {
		size_t count = collocation->row_offsets[i + 1] - collocation->row_offsets[i];
		longest = count > longest ? count : longest;
	}
	return longest;
}

gnp_status gnp_collocation_reorder(struct gnp_collocation *collocation, const uint32_t *position,
                                   const struct gnp_copies *copies, size_t points, struct gnp_error *error)
{
	struct gnp_collocation moved = {.rows = 0};
	struct gnp_collocation_rule rule = {.which = 0};
	size_t longest = longest_row(collocation);
	for (int d = 0; d < GNP_DERIVATIVE_COUNT; d++)
		rule.which |= collocation->value[d] ? GNP_DERIVATIVE_BIT(d) : 0;
	uint32_t *spare = gnp_array_new(points, sizeof *spare), *column_of = gnp_array_new(collocation->columns, sizeof *column_of);
	struct entry *entries = gnp_array_new(longest, sizeof *entries);
	moved.mass = collocation->mass ? gnp_array_new(points, sizeof *moved.mass) : NULL;
	bool room = spare && column_of && entries && (moved.mass || !collocation->mass);
	gnp_status status = room ? allocate(&rule, points, count_entries(collocation, copies), &moved, error)
	                         : GNP_OUT_OF_MEMORY;
	if (status == GNP_OK) {
		move_columns(collocation, position, points, column_of, spare, &moved);
		move_rows(collocation, position, copies, column_of, entries, &moved);
		gnp_collocation_clear(collocation);
		*collocation = moved;
	} else {
		gnp_collocation_clear(&moved);
		gnp_error_set(error, status, "laplacian: no memory to reorder %zu rows", points);
	}
	free(spare);
	free(column_of);
	free(entries);
	return status;
}
