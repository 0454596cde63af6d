#include "tests/property/trial.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "proto/file/file.h"
#include "proto/file/formats.h"
#include "proto/file/result.h"
#include "proto/operation/call.h"
#include "proto/operation/operations.h"
#include "tests/property/ask.h"
#include "tests/property/zoo.h"

/* Work whose estimate is over this is what admission refuses. */
static const size_t memory_most = (size_t)2 << 30;

/* ---- A watch that stops a task ---- */

struct trial_watch {
	pthread_mutex_t lock;
	pthread_cond_t changed;
	pthread_t thread;
	struct gnp_task *task; /* NULL: nothing to watch */
	double until, seconds;
	bool ended;
};

static void *watch_loop(void *context)
{
	struct trial_watch *watch = context;
	pthread_mutex_lock(&watch->lock);
	while (!watch->ended) {
		struct timespec until;
		clock_gettime(CLOCK_REALTIME, &until);
		until.tv_nsec += 50000000;
		until.tv_sec += until.tv_nsec / 1000000000;
		until.tv_nsec %= 1000000000;
		pthread_cond_timedwait(&watch->changed, &watch->lock, &until);
		if (watch->task && gnp_clock() > watch->until)
			gnp_task_stop(watch->task, GNP_DEADLINE);
	}
	pthread_mutex_unlock(&watch->lock);
	return NULL;
}

static void watch_task(struct trial_watch *watch, struct gnp_task *task)
{
	pthread_mutex_lock(&watch->lock);
	watch->task = task;
	watch->until = gnp_clock() + watch->seconds;
	pthread_mutex_unlock(&watch->lock);
}

bool trial_open(struct trial_bench *bench, const struct gnp_models *models, const char *url, double seconds)
{
	*bench = (struct trial_bench){.models = models, .url = url, .watch = calloc(1, sizeof *bench->watch)};
	if (!bench->watch || gnp_pool_create(1, &bench->pools[0], NULL) != GNP_OK || gnp_pool_create(2, &bench->pools[1], NULL) != GNP_OK)
		return false;
	bench->watch->seconds = seconds;
	pthread_mutex_init(&bench->watch->lock, NULL);
	pthread_cond_init(&bench->watch->changed, NULL);
	return pthread_create(&bench->watch->thread, NULL, watch_loop, bench->watch) == 0;
}

void trial_close(struct trial_bench *bench)
{
	struct trial_watch *watch = bench->watch;
	pthread_mutex_lock(&watch->lock);
	watch->ended = true;
	pthread_cond_signal(&watch->changed);
	pthread_mutex_unlock(&watch->lock);
	pthread_join(watch->thread, NULL);
	free(watch);
	gnp_pool_free(bench->pools[0]);
	gnp_pool_free(bench->pools[1]);
	ask_close();
}

/* ---- One request ---- */

struct trial {
	struct trial_bench *bench;
	const struct spec *spec;
	struct gnp_request request;
	struct gnp_call call;
	struct gnp_response response[2]; /* by one worker, by two */
	struct gnp_error error;          /* of the first */
	gnp_status status;
	char *text;
};

static gnp_status compute(struct trial *trial, int which, struct gnp_error *error)
{
	struct gnp_task task;
	gnp_task_init(&task);
	watch_task(trial->bench->watch, &task);
	gnp_status status = gnp_call_run(&trial->call, trial->bench->pools[which], &task, &trial->response[which], error);
	watch_task(trial->bench->watch, NULL);
	return status;
}

static enum trial_outcome failed(struct trial *trial, const char *where, const char *why)
{
	snprintf(trial->text, JUDGE_TEXT, "%s: %.*s", where, JUDGE_TEXT - 40, why);
	return TRIAL_FAILED;
}

/* The same with two workers. */
static bool repeat(struct trial *trial)
{
	struct gnp_error error = {0};
	char why[JUDGE_TEXT];
	gnp_status status = compute(trial, 1, &error);
	if (status == GNP_DEADLINE)
		return true;
	if (status != trial->status || strcmp(error.text, trial->error.text) != 0)
		return failed(trial, "two workers", status == GNP_OK ? "an answer where one worker refused" : error.text) != TRIAL_FAILED;
	if (status == GNP_OK && !judge_same(&trial->response[0], &trial->response[1], why))
		return failed(trial, "two workers", why) != TRIAL_FAILED;
	return true;
}

/* What is written as a file can be read again; what cannot be written is known before or named. */
static bool encode(struct trial *trial)
{
	const struct gnp_format *format;
	struct gnp_buffer buffer = {0};
	struct gnp_tensors back = {0};
	struct gnp_error error = {0};
	const char *name = spec_get(trial->spec, "format", "npz");
	if (!gnp_format_by_name(name, &format) || !gnp_format_writable(format) || gnp_result_check(format, &trial->call, NULL) != GNP_OK)
		return true;
	gnp_status status = gnp_result_encode(format, &trial->request, &trial->response[0], &buffer, &error);
	if (status == GNP_OK && gnp_format_readable(format))
		status = gnp_file_decode_all(format, buffer.data, buffer.size, &back, &error);
	else if (status == GNP_NOT_ACCEPTABLE)
		status = GNP_OK;
	gnp_tensors_clear(&back);
	gnp_buffer_clear(&buffer);
	return status == GNP_OK || failed(trial, name, error.text) != TRIAL_FAILED;
}

static bool ask(struct trial *trial)
{
	char why[JUDGE_TEXT];
	const struct ask ask = {trial->bench->url, trial->spec, &trial->call, &trial->request, trial->status, &trial->error, &trial->response[0]};
	return !trial->bench->url || !trial->bench->url[0] || ask_daemon(&ask, why) || failed(trial, "HTTP", why) != TRIAL_FAILED;
}

static enum trial_outcome judge(struct trial *trial)
{
	char why[JUDGE_TEXT];
	if (trial->status == GNP_DEADLINE)
		return TRIAL_TOO_LONG;
	if (trial->status == GNP_OK ? !judge_answer(&trial->call, &trial->response[0], why) : !judge_refusal(trial->status, &trial->error, why))
		return failed(trial, "answer", why);
	snprintf(trial->text, JUDGE_TEXT, "%.*s", JUDGE_TEXT - 1, trial->error.text);
	if (trial->call.operation && !repeat(trial))
		return TRIAL_FAILED;
	if (trial->status == GNP_OK && !encode(trial))
		return TRIAL_FAILED;
	if (!ask(trial))
		return TRIAL_FAILED;
	return trial->status == GNP_OK ? TRIAL_ANSWERED : TRIAL_REFUSED;
}

enum trial_outcome trial_run(struct trial_bench *bench, const struct spec *spec, char text[JUDGE_TEXT])
{
	struct trial trial = {.bench = bench, .spec = spec, .text = text};
	const struct gnp_operation *operation = gnp_operation_find(spec_get(spec, "op", ""));
	const struct gnp_limits limits = {.models = bench->models};
	enum trial_outcome outcome = TRIAL_TOO_LONG;
	text[0] = '\0';
	if (!operation || !zoo_request(spec, operation, &trial.request)) {
		outcome = failed(&trial, "line", "names what is not known");
	} else {
		trial.status = gnp_call_prepare(operation, &trial.request, &limits, &trial.call, &trial.error);
		if (trial.status == GNP_OK && trial.call.memory <= memory_most)
			trial.status = compute(&trial, 0, &trial.error);
		if (trial.status != GNP_OK || trial.call.memory <= memory_most)
			outcome = judge(&trial);
	}
	gnp_response_clear(&trial.response[0]);
	gnp_response_clear(&trial.response[1]);
	gnp_request_clear(&trial.request);
	return outcome;
}
