/* Status codes and the caller-owned error text.
 *
 * Every fallible function returns a gnp_status and, on failure, writes one sentence into a caller-owned
 * struct gnp_error (which may be NULL). The first error wins: a second gnp_error_set on the same object
 * changes nothing, so the cause nearest to the fault is the one reported.
 * Messages name the thing, the value and the limit: "points: got 3, need at least 16". */
#ifndef GNP_CORE_STATUS_H
#define GNP_CORE_STATUS_H

#include <stddef.h>

/* The one table: enumerator, wire name, HTTP status code, sentence. Nothing else maps errors. */
#define GNP_STATUS_TABLE(X)                                                                      \
	X(GNP_OK, "ok", 200, "success")                                                              \
	X(GNP_INVALID_ARGUMENT, "invalid_argument", 400, "the request is not valid")                 \
	X(GNP_UNAUTHORIZED, "unauthorized", 401, "a valid key is needed")                            \
	X(GNP_FORBIDDEN, "forbidden", 403, "the key does not allow this")                            \
	X(GNP_NOT_FOUND, "not_found", 404, "there is no such thing")                                 \
	X(GNP_METHOD_NOT_ALLOWED, "method_not_allowed", 405, "the method is not allowed here")       \
	X(GNP_NOT_ACCEPTABLE, "not_acceptable", 406, "the answer has no form of the requested type") \
	X(GNP_CLIENT_TIMEOUT, "client_timeout", 408, "the client sent its request too slowly")       \
	X(GNP_CONFLICT, "conflict", 409, "the request conflicts with an earlier one")                \
	X(GNP_IN_PROGRESS, "in_progress", 409, "the same request is being taken, try again")         \
	X(GNP_GONE, "gone", 410, "it has expired or was removed")                                    \
	X(GNP_TOO_LARGE, "too_large", 413, "the request is over a limit")                            \
	X(GNP_UNSUPPORTED_MEDIA, "unsupported_media", 415, "the body's format is not supported")     \
	X(GNP_RANGE, "range_not_satisfiable", 416, "the range lies outside of the thing")            \
	X(GNP_DEGENERATE, "degenerate_geometry", 422, "the points do not determine a surface")       \
	X(GNP_SINGULAR, "singular_system", 422, "the linear system is singular")                     \
	X(GNP_NO_CONVERGENCE, "no_convergence", 422, "the iteration did not converge")               \
	X(GNP_LIMITED, "limited", 429, "the caller is at its limit, try again later")                \
	X(GNP_CANCELLED, "cancelled", 499, "the work was cancelled")                                 \
	X(GNP_INTERNAL, "internal", 500, "an internal error")                                        \
	X(GNP_IO, "io", 500, "input or output failed")                                               \
	X(GNP_OUT_OF_MEMORY, "out_of_memory", 503, "memory is exhausted")                            \
	X(GNP_OVERLOADED, "overloaded", 503, "the server is at its limit, try again later")          \
	X(GNP_DRAINING, "draining", 503, "the server is shutting down")                              \
	X(GNP_UNAVAILABLE, "unavailable", 503, "the server lacks what this needs")                  \
	X(GNP_STORAGE, "storage", 503, "the disk failed")                                            \
	X(GNP_DEADLINE, "deadline_exceeded", 504, "the work took longer than its time limit")        \
	X(GNP_NO_SPACE, "no_space", 507, "there is no room to store it")

typedef enum gnp_status {
#define GNP_STATUS_ENUM(id, name, http, text) id,
	GNP_STATUS_TABLE(GNP_STATUS_ENUM)
#undef GNP_STATUS_ENUM
	GNP_STATUS_COUNT
} gnp_status;

/* Room for the longest list of known names and what stands before it (core/base/names.h). */
enum { GNP_ERROR_TEXT = 768 };

/* Zero-initialise before use: struct gnp_error error = {0}. */
struct gnp_error {
	gnp_status status;
	char text[GNP_ERROR_TEXT]; /* NUL-terminated, empty while status is GNP_OK */
};

/* Records status and text unless error is NULL or already holds an error. Returns status. */
gnp_status gnp_error_set(struct gnp_error *error, gnp_status status, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/* GNP_OUT_OF_MEMORY: "filter: no memory for 1000 points". what: who has none, cut after 120 bytes; things: what there are count of. */
gnp_status gnp_no_memory(const char *what, size_t count, const char *things, struct gnp_error *error);

/* The table's columns; an unknown status reads as GNP_INTERNAL. */
const char *gnp_status_name(gnp_status status);
int gnp_status_http(gnp_status status);
const char *gnp_status_text(gnp_status status);

#endif
