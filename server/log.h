/* Log lines on standard error: text or JSON, one write each, so that lines of several threads do not mix. */
#ifndef GNPD_LOG_H
#define GNPD_LOG_H

#include <stddef.h>

#include "config.h"

struct gnpd_log {
	enum gnpd_log_format format;
	int fd;
};

/* What one request leaves in the log. */
struct gnpd_access {
	const char *id, *remote, *method, *path, *code_name; /* code_name: the error's wire name, "ok" else */
	int status;                                          /* HTTP code */
	size_t bytes_in, bytes_out, points;
	double seconds, waited; /* in all, and of these in the queue */
};

void gnpd_log_access(const struct gnpd_log *log, const struct gnpd_access *access);

/* An event: level is "info", "warning" or "error". */
void gnpd_log_event(const struct gnpd_log *log, const char *level, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

#endif
