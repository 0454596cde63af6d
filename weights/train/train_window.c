#include "weights/train/train_window.h"

#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>

#include "core/base/memory.h"

struct gnp_train_window {
	struct gnp_train_data data;
	struct gnp_pool *pool;
	size_t size;
	uint64_t first;                 /* visit of the oldest cloud */
	struct gnp_train_cloud *clouds; /* (size) visit i lies at i % size */
	/* The visit after the last, in the making; the thread owns these until it is joined. */
	bool running;
	pthread_t thread;
	struct gnp_train_cloud next;
	gnp_status status;
	struct gnp_error error;
};

static void *make_next(void *context)
{
	struct gnp_train_window *window = context;
	window->status = gnp_train_data_enter(&window->data, window->first + window->size, window->pool, &window->next, &window->error);
	return NULL;
}

static gnp_status start_next(struct gnp_train_window *window, struct gnp_error *error)
{
	window->error = (struct gnp_error){0};
	if (pthread_create(&window->thread, NULL, make_next, window) != 0)
		return gnp_error_set(error, GNP_INTERNAL, "training: cannot start a thread for the next cloud");
	window->running = true;
	return GNP_OK;
}

static gnp_status join_next(struct gnp_train_window *window)
{
	pthread_join(window->thread, NULL);
	window->running = false;
	return window->status;
}

static gnp_status fill(struct gnp_train_window *window, struct gnp_error *error)
{
	window->clouds = gnp_array_zero(window->size, sizeof *window->clouds);
	if (!window->clouds)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory for %zu clouds", window->size);
	gnp_status status = GNP_OK;
	for (size_t i = 0; status == GNP_OK && i < window->size; i++)
		status = gnp_train_data_enter(&window->data, window->first + i, window->pool,
		                              &window->clouds[(window->first + i) % window->size], error);
	return status == GNP_OK ? start_next(window, error) : status;
}

gnp_status gnp_train_window_open(const struct gnp_train_data *data, size_t size, uint64_t first, struct gnp_pool *pool,
                                 struct gnp_train_window **out, struct gnp_error *error)
{
	struct gnp_train_window *window = calloc(1, sizeof *window);
	if (!window)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory for %zu clouds", size);
	*window = (struct gnp_train_window){.data = *data, .pool = pool, .size = size, .first = first};
	gnp_status status = fill(window, error);
	if (status == GNP_OK)
		*out = window;
	else
		gnp_train_window_close(window);
	return status;
}

gnp_status gnp_train_window_advance(struct gnp_train_window *window, struct gnp_error *error)
{
	gnp_status status = join_next(window);
	if (status != GNP_OK)
		return gnp_error_set(error, status, "%s", window->error.text);
	struct gnp_train_cloud *oldest = &window->clouds[window->first % window->size];
	gnp_train_cloud_clear(oldest);
	*oldest = window->next;
	window->first++;
	return start_next(window, error);
}

uint64_t gnp_train_window_first(const struct gnp_train_window *window)
{
	return window->first;
}

const struct gnp_train_cloud *gnp_train_window_at(const struct gnp_train_window *window, size_t i)
{
	return &window->clouds[(window->first + i) % window->size];
}

void gnp_train_window_close(struct gnp_train_window *window)
{
	if (!window)
		return;
	if (window->running && join_next(window) == GNP_OK)
		gnp_train_cloud_clear(&window->next);
	for (size_t i = 0; window->clouds && i < window->size; i++)
		gnp_train_cloud_clear(&window->clouds[i]);
	free(window->clouds);
	free(window);
}
