#include "weights/train/any/any_supports.h"

#include <math.h>
#include <stdbool.h>

#include "core/network/frame_choice.h"

static size_t at_most(size_t wanted, const struct gnp_any_cloud *cloud)
{
	return wanted < cloud->count ? wanted : cloud->count;
}

/* ---- Where ---- */

enum { TRIES = 30 };

static uint32_t draw_good(const struct gnp_any_cloud *cloud, struct gnp_random *random)
{
	uint32_t at;
	do
		at = (uint32_t)gnp_random_below(random, cloud->count);
	while (cloud->outlier[at]);
	return at;
}

/* Whether a point is one of those wanted. */
typedef bool (*wanted_fn)(const struct gnp_any_cloud *cloud, uint32_t at);

static bool is_displaced(const struct gnp_any_cloud *cloud, uint32_t at)
{
	return cloud->outlier[at] != GNP_ANY_GOOD;
}

static bool is_near_crease(const struct gnp_any_cloud *cloud, uint32_t at)
{
	static const double NEAR = 2.5;
	return !cloud->outlier[at] && cloud->edge[at] < NEAR;
}

/* One of those wanted, if some tries find any. */
static uint32_t draw_of(const struct gnp_any_cloud *cloud, wanted_fn wanted, struct gnp_random *random)
{
	for (int i = 0; i < TRIES; i++) {
		uint32_t at = (uint32_t)gnp_random_below(random, cloud->count);
		if (wanted(cloud, at))
			return at;
	}
	return draw_good(cloud, random);
}

static uint32_t draw_rare(const struct gnp_any_cloud *cloud, struct gnp_random *random)
{
	static const double OUTLIERS = 0.15, CREASES = 0.2;
	if (gnp_random_uniform(random) < OUTLIERS)
		return draw_of(cloud, is_displaced, random);
	return gnp_random_uniform(random) < CREASES ? draw_of(cloud, is_near_crease, random) : draw_good(cloud, random);
}

void gnp_any_supports_centres(const struct gnp_any_cloud *cloud, bool rare, size_t count, struct gnp_random *random,
                              uint32_t *centres)
{
	for (size_t i = 0; i < count; i++)
		centres[i] = rare ? draw_rare(cloud, random) : draw_good(cloud, random);
}

/* ---- How ---- */

gnp_status gnp_any_supports_look(const struct gnp_any_cloud *cloud, const uint32_t *centres, size_t count,
                                 struct gnp_scratch *scratch, struct gnp_any_views *views, struct gnp_error *error)
{
	const struct gnp_support_cloud source = gnp_any_cloud_source(cloud);
	size_t reach = at_most(GNP_LADDER_REACH, cloud);
	views->ladders = gnp_scratch_take(scratch, count, sizeof *views->ladders);
	if (!views->ladders)
		return gnp_no_memory("training", count, "ladders", error);
	gnp_status status = gnp_neighborhoods_find(source.neighbors, centres, count, reach, 1, reach, scratch,
	                                           &views->found, error);
	for (size_t i = 0; i < count && status == GNP_OK; i++) {
		size_t from = views->found.start[i];
		gnp_support_look(&source, centres[i], views->found.index + from, views->found.start[i + 1] - from,
		                 &views->ladders[i]);
	}
	return status;
}

/* Support of row i of the views; searches again where it reaches farther than they do. */
static gnp_status build_one(const struct gnp_any_cloud *cloud, const struct gnp_network *network,
                            const struct gnp_any_views *views, size_t i, uint32_t centre, double turn,
                            struct gnp_scratch *scratch, struct gnp_support *out, bool *built, struct gnp_error *error)
{
	const struct gnp_support_cloud source = gnp_any_cloud_source(cloud);
	const struct gnp_ladder *ladder = &views->ladders[i];
	unsigned step = gnp_frame_choose(network, ladder);
	size_t reach = at_most(gnp_support_reach(step), cloud);
	size_t from = views->found.start[i], count = views->found.start[i + 1] - from;
	const uint32_t *index = views->found.index + from;
	const double *distance = views->found.distance + from;
	struct gnp_neighborhoods wide;
	if (reach > GNP_LADDER_REACH) {
		gnp_status status = gnp_neighborhoods_find(source.neighbors, &centre, 1, reach, 1, reach, scratch, &wide,
		                                           error);
		if (status != GNP_OK)
			return status;
		count = wide.start[1];
		index = wide.index;
		distance = wide.distance;
	}
	*built = gnp_support_build(&source, centre, ladder, step, index, distance, count, turn, out);
	return GNP_OK;
}

gnp_status gnp_any_supports_build(const struct gnp_any_cloud *cloud, const struct gnp_network *network,
                                  const uint32_t *centres, size_t count, struct gnp_random *random,
                                  struct gnp_scratch *scratch, const struct gnp_support **supports,
                                  const struct gnp_any_cloud **clouds, size_t *made, struct gnp_error *error)
{
	struct gnp_any_views views;
	struct gnp_support *room = gnp_scratch_take(scratch, count, sizeof *room);
	if (!room)
		return gnp_no_memory("training", count, "supports", error);
	gnp_status status = gnp_any_supports_look(cloud, centres, count, scratch, &views, error);
	for (size_t i = 0; i < count && status == GNP_OK; i++) {
		bool built = false;
		double turn = 2 * M_PI * gnp_random_uniform(random);
		struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
		status = build_one(cloud, network, &views, i, centres[i], turn, scratch, &room[i], &built, error);
		gnp_scratch_release(scratch, mark);
		if (status != GNP_OK || !built)
			continue;
		supports[*made] = &room[i];
		clouds[(*made)++] = cloud;
	}
	return status;
}
