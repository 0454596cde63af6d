#include "core/cells/boundary.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/forest.h"
#include "core/base/memory.h"
#include "core/base/vector.h"
#include "core/cells/cell.h"
#include "core/cells/disk.h"
#include "core/search/neighborhoods.h"

enum {
	POINTS_A_CHUNK = 512,
	AROUND = 256, /* nearest points among which a gap has to be as wide */
	SIDES = 32,   /* among which there is a side without any */
	CHAIN = 8     /* outermost points, at least */
};

struct work {
	const struct gnp_prepared *prepared;
	double usual;
	unsigned char *asked;       /* (count) as enum asked */
	uint32_t (*along)[2];       /* (count) of outermost points the next ones */
	unsigned char *outermost;   /* (count) */
	_Atomic unsigned char *rim; /* (count) as enum verdict */
};

enum asked { NOT_YET, NOW, BEFORE };
enum verdict { INSIDE, PERHAPS, RIM };

/* ---- Passes over the points that are flagged ---- */

typedef gnp_status (*visit_fn)(struct work *work, size_t point, const struct gnp_disk_row *row,
                               struct gnp_scratch *scratch, struct gnp_error *error);

struct pass {
	struct work *work;
	bool (*flagged)(const struct work *work, size_t point);
	size_t neighbors;
	visit_fn visit;
};

static gnp_status find(const struct work *work, const uint32_t *centres, size_t count, size_t neighbors,
                       struct gnp_scratch *scratch, struct gnp_neighborhoods *found, struct gnp_error *error)
{
	size_t row = neighbors + 1 < work->prepared->count ? neighbors + 1 : work->prepared->count;
	return gnp_neighborhoods_find(work->prepared->neighbors, centres, count, row, 1, row, scratch, found, error);
}

static struct gnp_disk_row row_of(const struct gnp_neighborhoods *found, size_t r)
{
	size_t at = found->start[r], count = found->start[r + 1] - at;
	return (struct gnp_disk_row){count, found->index + at, found->distance[at + count - 1]};
}

static gnp_status pass_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                             struct gnp_error *error)
{
	const struct pass *pass = context;
	uint32_t *centres = gnp_scratch_take(scratch, end - begin, sizeof *centres);
	struct gnp_neighborhoods found;
	size_t count = 0;
	if (!centres)
		return gnp_no_memory("boundary", end - begin, "points", error);
	for (size_t i = begin; i < end; i++)
		if (pass->flagged(pass->work, i))
			centres[count++] = (uint32_t)i;
	if (count == 0)
		return GNP_OK;
	gnp_status status = find(pass->work, centres, count, pass->neighbors, scratch, &found, error);
	for (size_t r = 0; r < count && status == GNP_OK; r++) {
		const struct gnp_disk_row row = row_of(&found, r);
		struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
		status = pass->visit(pass->work, centres[r], &row, scratch, error);
		gnp_scratch_release(scratch, mark);
	}
	return status;
}

static bool is_asked(const struct work *work, size_t i)
{
	return work->asked[i] == NOW;
}

static bool is_outermost(const struct work *work, size_t i)
{
	return work->outermost[i];
}

static bool is_perhaps(const struct work *work, size_t i)
{
	return atomic_load_explicit(&work->rim[i], memory_order_relaxed) == PERHAPS;
}

/* ---- Outermost points ---- */

/* The mean direction of the nearest normals, which at a crease is between those of its sides. False where some are of
 * the other side of something thin: there the surface comes back right behind the point. */
static bool mean_normal(const double *normals, size_t centre, const struct gnp_disk_row *row, double mean[3])
{
	enum { NEAREST = 13, FEW = 2 };
	static const double OTHER = -0.2;
	size_t others = 0;
	memset(mean, 0, 3 * sizeof *mean);
	for (size_t j = 0; j < row->count && j < NEAREST; j++) {
		const double *n = normals + 3 * (size_t)row->index[j];
		others += gnp_dot(n, normals + 3 * centre) < OTHER;
		for (int c = 0; c < 3; c++)
			mean[c] += n[c];
	}
	double length = sqrt(gnp_dot(mean, mean));
	for (int c = 0; c < 3; c++)
		mean[c] /= length;
	return others < FEW && length > 0;
}

static gnp_status judge(struct work *work, size_t i, const struct gnp_disk_row *row, struct gnp_scratch *scratch,
                        struct gnp_error *error)
{
	const double *normals = work->prepared->normals;
	double wide = work->usual * row->farthest, mean[3];
	struct gnp_disk disk, between;
	(void)scratch;
	(void)error;
	work->asked[i] = BEFORE;
	gnp_disk_find(work->prepared->points, i, normals + 3 * i, row, wide, &disk);
	if (!(disk.radius > wide) || !mean_normal(normals, i, row, mean))
		return GNP_OK;
	gnp_disk_find(work->prepared->points, i, mean, row, wide, &between);
	if (!(between.radius > wide))
		return GNP_OK;
	memcpy(work->along[i], disk.along, sizeof disk.along);
	work->outermost[i] = 1;
	return GNP_OK;
}

/* Whether there are points along the rim that have not been looked at. */
static bool follow(struct work *work)
{
	bool more = false;
	for (size_t i = 0; i < work->prepared->count; i++)
		for (int side = 0; work->outermost[i] && side < 2; side++) {
			uint32_t next = work->along[i][side];
			if (next == GNP_DISK_NOBODY || work->asked[next] != NOT_YET)
				continue;
			work->asked[next] = NOW;
			more = true;
		}
	return more;
}

/* A gap is none where it is usual for a point across, whose own neighbours are clearly farther apart. */
static gnp_status drop_sparse(struct work *work, size_t i, const struct gnp_disk_row *row, struct gnp_scratch *scratch,
                              struct gnp_error *error)
{
	static const double SPARSER = 1.15;
	double own = 0, theirs;
	struct gnp_neighborhoods found;
	struct gnp_disk disk;
	gnp_status status = GNP_OK;
	gnp_disk_find(work->prepared->points, i, work->prepared->normals + 3 * i, row, 0, &disk);
	const uint32_t asked[3] = {(uint32_t)i, disk.across[0], disk.across[1]};
	for (size_t a = 0; a < 3 && status == GNP_OK; a++) {
		if (asked[a] == GNP_DISK_NOBODY)
			continue;
		status = find(work, asked + a, 1, GNP_DISK_NEIGHBORS, scratch, &found, error);
		theirs = status == GNP_OK ? row_of(&found, 0).farthest : 0;
		own = a == 0 ? theirs : own;
		if (disk.radius <= work->usual * theirs && theirs > SPARSER * own)
			work->outermost[i] = 0;
	}
	return status;
}

/* Drops outermost points of short chains. */
static gnp_status drop_short(struct work *work, struct gnp_error *error)
{
	size_t count = work->prepared->count;
	struct gnp_forest chains;
	bool flipped;
	gnp_status status = GNP_OK;
	if (!memchr(work->outermost, 1, count))
		return GNP_OK;
	if (!gnp_forest_init(&chains, count))
		status = gnp_no_memory("boundary", count, "points", error);
	for (size_t i = 0; i < count && status == GNP_OK; i++)
		for (int side = 0; work->outermost[i] && side < 2; side++)
			if (work->along[i][side] != GNP_DISK_NOBODY && work->outermost[work->along[i][side]])
				gnp_forest_join(&chains, (uint32_t)i, work->along[i][side], false, SIZE_MAX);
	for (size_t i = 0; i < count && status == GNP_OK; i++)
		if (work->outermost[i] && chains.size[gnp_forest_find(&chains, (uint32_t)i, &flipped)] < CHAIN)
			work->outermost[i] = 0;
	gnp_forest_clear(&chains);
	return status;
}

/* ---- The rim along them ---- */

static double distance_to_segment(const double p[3], const double a[3], const double b[3])
{
	double along[3], to[3], square = 0;
	for (int c = 0; c < 3; c++) {
		along[c] = b[c] - a[c];
		to[c] = p[c] - a[c];
	}
	double length = gnp_dot(along, along), t = length > 0 ? fmin(fmax(gnp_dot(along, to) / length, 0), 1) : 0;
	for (int c = 0; c < 3; c++)
		square += (to[c] - t * along[c]) * (to[c] - t * along[c]);
	return sqrt(square);
}

static void raise(_Atomic unsigned char *at, unsigned char verdict)
{
	unsigned char had = atomic_load_explicit(at, memory_order_relaxed);
	while (had < verdict && !atomic_compare_exchange_weak_explicit(at, &had, verdict, memory_order_relaxed,
	                                                               memory_order_relaxed))
		continue;
}

static gnp_status spread(struct work *work, size_t i, const struct gnp_disk_row *row, struct gnp_scratch *scratch,
                         struct gnp_error *error)
{
	static const double SURE = 0.7, MAY_BE = 1.6; /* spacings */
	static const double SPACING = 1 / 6.4;        /* of the distance of the last neighbour, on half a plane */
	const double *points = work->prepared->points, spacing = SPACING * row->farthest;
	(void)scratch;
	(void)error;
	raise(&work->rim[i], RIM);
	for (int side = 0; side < 2; side++) {
		uint32_t next = work->along[i][side];
		if (next == GNP_DISK_NOBODY || !work->outermost[next])
			continue;
		for (size_t j = 0; j < row->count; j++) {
			const double *p = points + 3 * (size_t)row->index[j];
			double away = distance_to_segment(p, points + 3 * i, points + 3 * (size_t)next);
			if (away <= MAY_BE * spacing)
				raise(&work->rim[row->index[j]], away <= SURE * spacing ? RIM : PERHAPS);
		}
	}
	return GNP_OK;
}

/* Whether the near ones leave a gap of about 80 degrees. */
static bool is_one_sided(const double *points, size_t centre, const double normal[3], const struct gnp_disk_row *row)
{
	enum { SECTORS = 72, GAP = 16 };
	static const double UPRIGHT = 1e-6, TURN = 6.283185307179586;
	const double *o = points + 3 * centre;
	double tangents[2][3];
	bool seen[SECTORS] = {false};
	gnp_tangents_of(normal, tangents);
	for (size_t j = 0; j < row->count; j++) {
		const double *p = points + 3 * (size_t)row->index[j], d[3] = {p[0] - o[0], p[1] - o[1], p[2] - o[2]};
		double x = gnp_dot(d, tangents[0]), y = gnp_dot(d, tangents[1]);
		if (x * x + y * y > UPRIGHT * gnp_dot(d, d))
			seen[(int)((atan2(y, x) / TURN + 0.5) * (SECTORS - 1e-9))] = true;
	}
	int run = 0;
	for (int s = 0; s < 2 * SECTORS && run < GAP; s++)
		run = seen[s % SECTORS] ? 0 : run + 1;
	return run >= GAP;
}

static gnp_status decide(struct work *work, size_t i, const struct gnp_disk_row *row, struct gnp_scratch *scratch,
                         struct gnp_error *error)
{
	(void)scratch;
	(void)error;
	if (is_one_sided(work->prepared->points, i, work->prepared->normals + 3 * i, row))
		raise(&work->rim[i], RIM);
	return GNP_OK;
}

/* ---- All of it ---- */

static gnp_status pass(struct work *work, bool (*flagged)(const struct work *work, size_t point), size_t neighbors,
                       visit_fn visit, struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	struct pass pass = {work, flagged, neighbors, visit};
	return gnp_pool_run(pool, task, work->prepared->count, POINTS_A_CHUNK, pass_chunk, &pass, error);
}

static gnp_status run(struct work *work, struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	enum { ROUNDS = 16 };
	gnp_status status = pass(work, is_asked, GNP_DISK_NEIGHBORS, judge, pool, task, error);
	for (int round = 0; round < ROUNDS && status == GNP_OK && follow(work); round++)
		status = pass(work, is_asked, GNP_DISK_NEIGHBORS, judge, pool, task, error);
	if (status == GNP_OK)
		status = pass(work, is_outermost, AROUND, drop_sparse, pool, task, error);
	if (status == GNP_OK)
		status = drop_short(work, error);
	if (status == GNP_OK)
		status = pass(work, is_outermost, GNP_DISK_NEIGHBORS, spread, pool, task, error);
	if (status == GNP_OK)
		status = pass(work, is_perhaps, SIDES, decide, pool, task, error);
	return status;
}

gnp_status gnp_boundary_find(const struct gnp_prepared *prepared, double usual, const unsigned char *candidate,
                        struct gnp_pool *pool, struct gnp_task *task, unsigned char *rim, struct gnp_error *error)
{
	size_t count = prepared->count;
	struct work work = {.prepared = prepared, .usual = usual, .asked = gnp_array_new(count, 1),
	                    .along = gnp_array_new(count, sizeof *work.along), .outermost = gnp_array_zero(count, 1),
	                    .rim = gnp_array_zero(count, sizeof *work.rim)};
	gnp_status status = GNP_OK;
	if (!work.asked || !work.along || !work.outermost || !work.rim)
		status = gnp_no_memory("boundary", count, "points", error);
	for (size_t i = 0; i < count && status == GNP_OK; i++)
		work.asked[i] = !candidate || candidate[i] ? NOW : NOT_YET;
	if (status == GNP_OK)
		status = run(&work, pool, task, error);
	for (size_t i = 0; i < count && status == GNP_OK; i++)
		rim[i] = atomic_load_explicit(&work.rim[i], memory_order_relaxed) == RIM;
	free(work.asked);
	free(work.along);
	free(work.outermost);
	free((void *)work.rim);
	return status;
}

/* Chains come with a forest of 8 bytes a point. */
size_t gnp_boundary_memory(size_t count)
{
	const struct work *work = NULL;
	return count * (sizeof *work->asked + sizeof *work->along + sizeof *work->outermost + sizeof *work->rim + 8);
}
