/* Writes log lines to standard error: text or JSON, one write each, so that lines of several threads do not mix. A
 * line is written only where that does not wait: when a pipe is full because nobody reads it, lines are dropped, and
 * the next that fits is preceded by one that says how many. */
#ifndef GNPD_LOG_H
#define GNPD_LOG_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>

enum gnpd_log_format { GNPD_LOG_TEXT, GNPD_LOG_JSON };
enum gnpd_log_level { GNPD_LOG_ERROR, GNPD_LOG_WARNING, GNPD_LOG_INFO, GNPD_LOG_DEBUG };

/* Their names: text, json; error, warning, info, debug. NULL past the last. */
const char *gnpd_log_format_name(enum gnpd_log_format format);
const char *gnpd_log_level_name(enum gnpd_log_level level);
/* name: length bytes. False when there is no such level. */
bool gnpd_log_level_find(const char *name, size_t length, enum gnpd_log_level *level);

struct gnpd_log {
	enum gnpd_log_format format;
	int fd;
	atomic_int level;     /* enum gnpd_log_level; any thread may change it */
	pthread_mutex_t lock; /* between asking for room and writing */
	size_t dropped;       /* lines since the last that was written */
};

void gnpd_log_init(struct gnpd_log *log, enum gnpd_log_format format, enum gnpd_log_level level, int fd);
void gnpd_log_fini(struct gnpd_log *log);

/* What one request leaves in the log. */
struct gnpd_access {
	const char *id, *remote, *method, *path, *code_name; /* code_name: the error's wire name, "ok" else */
	const char *principal;                               /* whose key it came with; "" without */
	int status;                                          /* HTTP code */
	size_t bytes_in, bytes_out, points;
	double seconds, waited; /* in all, and of these in the queue */
};

/* Would a line of this level be written? */
bool gnpd_log_wants(struct gnpd_log *log, enum gnpd_log_level level);

/* A line of level info. */
void gnpd_log_access(struct gnpd_log *log, const struct gnpd_access *access);

/* An event. */
void gnpd_log_event(struct gnpd_log *log, enum gnpd_log_level level, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

#endif
