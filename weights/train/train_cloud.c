#include "weights/train/train_cloud.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/random.h"
#include "core/shapes/shapes.h"

void gnp_train_cloud_clear(struct gnp_train_cloud *cloud)
{
	gnp_train_shape_clear(&cloud->shape);
	gnp_prepared_clear(&cloud->prepared);
	free(cloud->outlier);
	*cloud = (struct gnp_train_cloud){0};
}

static void measure(struct gnp_train_cloud *cloud)
{
	double form = 0, gaussian = 0, mean = 0, count = (double)cloud->shape.count;
	for (size_t i = 0; i < cloud->shape.count; i++) {
		const float *s = cloud->shape.second_form + 6 * i;
		double trace = (double)s[0] + s[3] + s[5];
		double square = (double)s[0] * s[0] + (double)s[3] * s[3] + (double)s[5] * s[5] +
		                2 * ((double)s[1] * s[1] + (double)s[2] * s[2] + (double)s[4] * s[4]);
		double k = (trace * trace - square) / 2;
		form += square;
		gaussian += k * k;
		mean += trace * trace / 4;
	}
	cloud->typical_form = sqrt(form / count);
	cloud->typical_gaussian = sqrt(gaussian / count);
	cloud->typical_mean = sqrt(mean / count);
}

/* Room for a shape's displaced points. */
struct room {
	double *points, *normals; /* (count, 3) */
	unsigned char *outlier;   /* (count) */
};

static gnp_status displace_and_prepare(struct gnp_train_cloud *cloud, enum gnp_regime regime, double noise, uint64_t noise_seed,
                                       const struct room *room, struct gnp_pool *pool, struct gnp_error *error)
{
	const struct gnp_regime_info *info = gnp_regime_info(regime);
	size_t n = cloud->shape.count;
	const struct gnp_sample_options options = {.count = n, .seed = noise_seed, .noise = noise,
	                                           .outlier_fraction = info->outlier_fraction, .outlier_noise = info->outlier_noise};
	struct gnp_sample sample = {.count = n, .points = room->points, .exact = cloud->shape.exact, .outlier = room->outlier};
	gnp_status status = gnp_sample_displace(&options, &sample, error);
	if (status != GNP_OK)
		return status;
	for (size_t i = 0; i < 3 * n; i++)
		room->normals[i] = cloud->shape.normals[i];
	const struct gnp_cloud whole = {n, room->points, room->normals};
	status = gnp_prepare(&whole, pool, NULL, &cloud->prepared, error);
	for (size_t i = 0; status == GNP_OK && i < n; i++)
		cloud->outlier[i] = room->outlier[cloud->prepared.order[i]];
	return status;
}

gnp_status gnp_train_cloud_enter_take(struct gnp_train_shape *shape, enum gnp_regime regime, double noise, uint64_t noise_seed,
                                      struct gnp_pool *pool, struct gnp_train_cloud *out, struct gnp_error *error)
{
	struct gnp_train_cloud cloud = {.shape = *shape};
	size_t n = shape->count;
	struct room room = {gnp_array_new(n, 3 * sizeof *room.points), gnp_array_new(n, 3 * sizeof *room.normals), gnp_array_zero(n, 1)};
	gnp_status status = GNP_OK;
	*shape = (struct gnp_train_shape){0};
	cloud.outlier = gnp_array_new(n, 1);
	if (!room.points || !room.normals || !room.outlier || !cloud.outlier)
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "training cloud: no memory for %zu points", n);
	if (status == GNP_OK)
		status = displace_and_prepare(&cloud, regime, noise, noise_seed, &room, pool, error);
	free(room.points);
	free(room.normals);
	free(room.outlier);
	if (status == GNP_OK) {
		measure(&cloud);
		*out = cloud;
	} else {
		gnp_train_cloud_clear(&cloud);
	}
	return status;
}

/* ---- Visits ---- */

static struct gnp_train_shape_key training_key(const struct gnp_train_data *data, size_t i)
{
	return (struct gnp_train_shape_key){.seed = i, .degree = gnp_radial_degree(i), .points = data->points};
}

static struct gnp_train_shape_key watch_key(const struct gnp_train_data *data, size_t i)
{
	/* an odd stride: every degree in turn, and the first few are both smooth and rough */
	return (struct gnp_train_shape_key){.seed = GNP_SEED_WATCH + i, .degree = gnp_radial_degree(5 * i), .points = data->points};
}

gnp_status gnp_train_data_ensure(const struct gnp_train_data *data, size_t watch, struct gnp_pool *pool, struct gnp_task *task,
                                 struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	gnp_task_stage(task, GNP_STAGE_PREPARE, data->shapes + watch);
	for (size_t i = 0; status == GNP_OK && i < data->shapes + watch; i++) {
		struct gnp_train_shape_key key = i < data->shapes ? training_key(data, i) : watch_key(data, i - data->shapes);
		status = gnp_train_shape_ensure(data->folder, &key, pool, NULL, error);
		if (status == GNP_OK)
			status = gnp_task_check(task, error);
		if (task)
			gnp_task_advance(task, 1);
	}
	return status;
}

/* Streams of the training seed that belong to visits; the number of the epoch or visit is in the low bits. */
static const uint64_t STREAM_SHUFFLE = UINT64_C(0x11) << 56, STREAM_NOISE = UINT64_C(0x12) << 56;

gnp_status gnp_train_data_visit(const struct gnp_train_data *data, uint64_t visit, struct gnp_train_visit *out,
                                struct gnp_error *error)
{
	uint64_t epoch = visit / data->shapes;
	size_t turn = (size_t)(visit % data->shapes);
	size_t *order = gnp_array_new(data->shapes, sizeof *order);
	struct gnp_random random;
	if (!order)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training shapes: no memory for %zu", data->shapes);
	gnp_random_seed(&random, data->seed, STREAM_SHUFFLE | epoch);
	for (size_t i = 0; i < data->shapes; i++)
		order[i] = i;
	for (size_t i = 0; i <= turn; i++) {
		size_t other = i + gnp_random_below(&random, data->shapes - i), chosen = order[other];
		order[other] = order[i];
		order[i] = chosen;
	}
	out->key = training_key(data, order[turn]);
	free(order);
	gnp_random_seed(&random, data->seed, STREAM_NOISE | visit);
	out->noise_seed = gnp_random_below(&random, GNP_SEED_WATCH);
	out->noise = gnp_regime_info(data->regime)->noise;
	if (data->least_noise > 0 && visit % 2)
		out->noise = data->least_noise * pow(data->most_noise / data->least_noise, gnp_random_uniform(&random));
	gnp_status status = gnp_seed_check_training(out->key.seed, error);
	return status == GNP_OK ? gnp_seed_check_training(out->noise_seed, error) : status;
}

static gnp_status enter(const struct gnp_train_data *data, const struct gnp_train_visit *visit, struct gnp_pool *pool,
                        struct gnp_train_cloud *out, struct gnp_error *error)
{
	struct gnp_train_shape shape;
	gnp_status status = gnp_train_shape_load(data->folder, &visit->key, pool, NULL, &shape, error);
	return status == GNP_OK ? gnp_train_cloud_enter_take(&shape, data->regime, visit->noise, visit->noise_seed, pool, out, error) : status;
}

gnp_status gnp_train_data_watch(const struct gnp_train_data *data, size_t i, struct gnp_pool *pool, struct gnp_train_cloud *out,
                                struct gnp_error *error)
{
	struct gnp_train_visit visit = {.key = watch_key(data, i)};
	visit.noise_seed = visit.key.seed;
	visit.noise = gnp_regime_info(data->regime)->noise;
	if (!gnp_seed_is_watch(visit.key.seed))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "watched shape: got number %zu, need less than 2^51", i);
	return enter(data, &visit, pool, out, error);
}

gnp_status gnp_train_data_enter(const struct gnp_train_data *data, uint64_t number, struct gnp_pool *pool,
                                struct gnp_train_cloud *out, struct gnp_error *error)
{
	struct gnp_train_visit visit;
	gnp_status status = gnp_train_data_visit(data, number, &visit, error);
	return status == GNP_OK ? enter(data, &visit, pool, out, error) : status;
}
