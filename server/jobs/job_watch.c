#include "server/jobs/job_watch.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/base/clock.h"
#include "server/config/config.h"
#include "server/jobs/job_json.h"

/* Seconds between two reports of progress. */
static const double BETWEEN = 0.5;

struct gnpd_watchers {
	const struct gnpd_config *config;
	pthread_mutex_t lock;
	pthread_cond_t wake;
	struct gnpd_watch *first; /* polls that wait, streams that are suspended */
	size_t count;             /* of all watches */
	bool changed, ending, stopping;
	pthread_t thread;
};

/* ---- The list; lock held ---- */

static void link_watch(struct gnpd_watchers *watchers, struct gnpd_watch *watch)
{
	watch->previous = NULL;
	watch->next = watchers->first;
	if (watchers->first)
		watchers->first->previous = watch;
	watchers->first = watch;
	watch->listed = true;
}

static void unlink_watch(struct gnpd_watchers *watchers, struct gnpd_watch *watch)
{
	if (watch->previous)
		watch->previous->next = watch->next;
	else
		watchers->first = watch->next;
	if (watch->next)
		watch->next->previous = watch->previous;
	watch->previous = watch->next = NULL;
	watch->listed = false;
}

static bool is_over(const struct gnpd_job_view *view)
{
	return view->removed || gnpd_job_state_is_final(view->record.state);
}

/* ---- What a stream tells; lock held ---- */

void gnpd_watch_event_id(const struct gnpd_job_view *view, char id[GNPD_EVENT_ID])
{
	snprintf(id, GNPD_EVENT_ID, "%u.%s", view->version, gnpd_job_state_name(view->record.state));
}

static void tell(struct gnpd_watch *watch, const struct gnpd_job_view *view, const char *event)
{
	struct gnp_buffer *text = &watch->text;
	char id[GNPD_EVENT_ID];
	gnpd_watch_event_id(view, id);
	gnp_status status = gnp_buffer_printf(text, NULL, "event: %s\nid: %s\ndata: ", event, id);
	if (status == GNP_OK)
		status = gnpd_job_write_json(view, text, NULL);
	if (status == GNP_OK)
		status = gnp_buffer_printf(text, NULL, "\n\n");
	if (status != GNP_OK)
		watch->over = true; /* no memory: the client sees the end and asks again */
	watch->told = gnp_clock();
}

/* Writes what is new into the stream's text, if there is anything. */
static void compose(struct gnpd_watchers *watchers, struct gnpd_watch *watch)
{
	struct gnpd_job_view view;
	double now = gnp_clock();
	gnpd_job_look(watch->job, &view);
	if (!watch->begun || view.version != watch->version) {
		watch->begun = true;
		watch->version = view.version;
		watch->fraction = view.progress.fraction;
		watch->progressed = now;
		tell(watch, &view, "state");
	} else if (view.progress.fraction != watch->fraction && now - watch->progressed >= BETWEEN) {
		watch->progressed = now;
		watch->fraction = view.progress.fraction;
		tell(watch, &view, "progress");
	} else if (now - watch->told >= watchers->config->jobs_heartbeat_seconds) {
		watch->told = now;
		if (gnp_buffer_printf(&watch->text, NULL, ": heartbeat\n\n") != GNP_OK)
			watch->over = true;
	}
	watch->over = watch->over || is_over(&view) || watchers->ending;
}

ssize_t gnpd_watch_read(struct gnpd_watch *watch, char *data, size_t most, void (*suspend)(struct gnpd_watch *watch))
{
	struct gnpd_watchers *watchers = watch->watchers;
	pthread_mutex_lock(&watchers->lock);
	if (watch->sent == watch->text.size) {
		watch->sent = watch->text.size = 0;
		if (!watch->over)
			compose(watchers, watch);
	}
	size_t size = watch->text.size - watch->sent;
	size = size < most ? size : most;
	if (size)
		memcpy(data, watch->text.data + watch->sent, size);
	watch->sent += size;
	bool waits = size == 0 && !watch->over;
	if (waits) {
		watch->suspended = true;
		link_watch(watchers, watch);
		suspend(watch);
	}
	pthread_mutex_unlock(&watchers->lock);
	return size ? (ssize_t)size : waits ? 0 : -1;
}

/* Lock held. */
static void resume_stream(struct gnpd_watchers *watchers, struct gnpd_watch *watch)
{
	if (!watch->suspended)
		return;
	watch->suspended = false;
	unlink_watch(watchers, watch);
	watch->wake(watch);
}

void gnpd_watch_leave(struct gnpd_watch *watch)
{
	struct gnpd_watchers *watchers = watch->watchers;
	pthread_mutex_lock(&watchers->lock);
	watch->over = true;
	resume_stream(watchers, watch);
	pthread_mutex_unlock(&watchers->lock);
}

/* ---- Polls ---- */

void gnpd_watch_wait(struct gnpd_watch *watch)
{
	struct gnpd_watchers *watchers = watch->watchers;
	pthread_mutex_lock(&watchers->lock);
	link_watch(watchers, watch);
	watchers->changed = true;
	pthread_cond_signal(&watchers->wake);
	pthread_mutex_unlock(&watchers->lock);
}

bool gnpd_watch_withdraw(struct gnpd_watch *watch)
{
	struct gnpd_watchers *watchers = watch->watchers;
	pthread_mutex_lock(&watchers->lock);
	bool listed = watch->listed;
	if (listed)
		unlink_watch(watchers, watch);
	pthread_mutex_unlock(&watchers->lock);
	return listed;
}

/* ---- The thread ---- */

/* Lock held. Wakes streams that have something to tell; unlinks polls that have their answer and returns them. */
static struct gnpd_watch *look(struct gnpd_watchers *watchers)
{
	struct gnpd_watch *answered = NULL, *next;
	double now = gnp_clock();
	for (struct gnpd_watch *watch = watchers->first; watch; watch = next) {
		next = watch->next;
		if (watch->kind == GNPD_WATCH_STREAM) {
			compose(watchers, watch);
			if (watch->text.size || watch->over)
				resume_stream(watchers, watch);
			continue;
		}
		struct gnpd_job_view view;
		gnpd_job_look(watch->job, &view);
		if (!is_over(&view) && now < watch->until && !watchers->ending)
			continue;
		unlink_watch(watchers, watch);
		watch->next = answered;
		answered = watch;
	}
	return answered;
}

static void *watch_main(void *argument)
{
	struct gnpd_watchers *watchers = argument;
	pthread_mutex_lock(&watchers->lock);
	while (!watchers->stopping) {
		watchers->changed = false;
		struct gnpd_watch *answered = look(watchers);
		pthread_mutex_unlock(&watchers->lock);
		while (answered) {
			struct gnpd_watch *watch = answered;
			answered = watch->next;
			watch->next = NULL;
			watch->wake(watch);
		}
		pthread_mutex_lock(&watchers->lock);
		if (!watchers->stopping && !watchers->changed)
			gnpd_clock_tick(&watchers->wake, &watchers->lock);
	}
	pthread_mutex_unlock(&watchers->lock);
	return NULL;
}

/* ---- Life ---- */

gnp_status gnpd_watchers_create(const struct gnpd_config *config, struct gnpd_watchers **out, struct gnp_error *error)
{
	struct gnpd_watchers *watchers = calloc(1, sizeof *watchers);
	if (!watchers)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "watchers: no memory");
	gnpd_clock_init(&watchers->wake);
	pthread_mutex_init(&watchers->lock, NULL);
	watchers->config = config;
	if (pthread_create(&watchers->thread, NULL, watch_main, watchers) != 0) {
		pthread_cond_destroy(&watchers->wake);
		pthread_mutex_destroy(&watchers->lock);
		free(watchers);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "watchers: no thread");
	}
	*out = watchers;
	return GNP_OK;
}

void gnpd_watchers_end(struct gnpd_watchers *watchers)
{
	pthread_mutex_lock(&watchers->lock);
	watchers->ending = watchers->changed = true;
	pthread_cond_signal(&watchers->wake);
	pthread_mutex_unlock(&watchers->lock);
}

void gnpd_watchers_free(struct gnpd_watchers *watchers)
{
	if (!watchers)
		return;
	pthread_mutex_lock(&watchers->lock);
	watchers->stopping = true;
	pthread_cond_signal(&watchers->wake);
	pthread_mutex_unlock(&watchers->lock);
	pthread_join(watchers->thread, NULL);
	pthread_cond_destroy(&watchers->wake);
	pthread_mutex_destroy(&watchers->lock);
	free(watchers);
}

void gnpd_watchers_notify(struct gnpd_watchers *watchers)
{
	if (!watchers)
		return;
	pthread_mutex_lock(&watchers->lock);
	watchers->changed = true;
	pthread_cond_signal(&watchers->wake);
	pthread_mutex_unlock(&watchers->lock);
}

gnp_status gnpd_watch_init(struct gnpd_watchers *watchers, struct gnpd_watch *watch, enum gnpd_watch_kind kind, struct gnpd_job *job,
                           struct gnp_error *error)
{
	size_t most = watchers->config->jobs_watch_count;
	pthread_mutex_lock(&watchers->lock);
	bool room = watchers->count < most;
	watchers->count += room;
	pthread_mutex_unlock(&watchers->lock);
	if (!room)
		return gnp_error_set(error, GNP_OVERLOADED, "jobs: %zu requests wait for jobs to change, at most %zu may (jobs-watch-count)", most,
		                     most);
	*watch = (struct gnpd_watch){.kind = kind, .job = job, .watchers = watchers, .counted = true};
	return GNP_OK;
}

void gnpd_watch_clear(struct gnpd_watch *watch)
{
	if (watch->counted) {
		pthread_mutex_lock(&watch->watchers->lock);
		watch->watchers->count--;
		pthread_mutex_unlock(&watch->watchers->lock);
	}
	gnp_buffer_clear(&watch->text);
	gnpd_job_release(watch->job);
	memset(watch, 0, sizeof *watch);
}

size_t gnpd_watchers_count(struct gnpd_watchers *watchers)
{
	pthread_mutex_lock(&watchers->lock);
	size_t count = watchers->count;
	pthread_mutex_unlock(&watchers->lock);
	return count;
}
