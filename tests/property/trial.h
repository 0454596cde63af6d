/* One request of the property tests run in this process: with one worker, with two, as a file, and over HTTP where there is a daemon. */
#ifndef GNP_TESTS_PROPERTY_TRIAL_H
#define GNP_TESTS_PROPERTY_TRIAL_H

#include <stdbool.h>

#include "core/base/pool.h"
#include "core/model/models.h"
#include "tests/property/judge.h"
#include "tests/property/spec.h"

/* What trials share within a process. */
struct trial_bench {
	const struct gnp_models *models;
	struct gnp_pool *pools[2];    /* of one and of two workers */
	struct trial_watch *watch;    /* ends what takes too long */
	const char *url;              /* of a daemon; "" or NULL: none */
};

enum trial_outcome { TRIAL_ANSWERED, TRIAL_REFUSED, TRIAL_TOO_LONG, TRIAL_FAILED };

/* Threads are made here: after any fork. seconds: most for one computation. */
bool trial_open(struct trial_bench *bench, const struct gnp_models *models, const char *url, double seconds);
void trial_close(struct trial_bench *bench);
/* text: why it failed, or the refusal. */
enum trial_outcome trial_run(struct trial_bench *bench, const struct spec *spec, char text[JUDGE_TEXT]);

#endif
