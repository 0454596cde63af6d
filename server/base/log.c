#include "server/base/log.h"

#include <poll.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

/* Bytes of a line, of what a client sent (of these each may take six as it is escaped), and of a message. */
enum { LINE = 3584, SENT = 200, MESSAGE = 512 };

static const char *const formats[] = {[GNPD_LOG_TEXT] = "text", [GNPD_LOG_JSON] = "json"};
static const char *const levels[] = {[GNPD_LOG_ERROR] = "error", [GNPD_LOG_WARNING] = "warning",
                                     [GNPD_LOG_INFO] = "info", [GNPD_LOG_DEBUG] = "debug"};
enum { FORMATS = sizeof formats / sizeof formats[0], LEVELS = sizeof levels / sizeof levels[0] };

const char *gnpd_log_format_name(enum gnpd_log_format format)
{
	return (unsigned)format < FORMATS ? formats[format] : NULL;
}

const char *gnpd_log_level_name(enum gnpd_log_level level)
{
	return (unsigned)level < LEVELS ? levels[level] : NULL;
}

bool gnpd_log_level_find(const char *name, size_t length, enum gnpd_log_level *level)
{
	for (int i = 0; i < LEVELS; i++)
		if (strlen(levels[i]) == length && memcmp(levels[i], name, length) == 0) {
			*level = (enum gnpd_log_level)i;
			return true;
		}
	return false;
}

struct line {
	char text[LINE];
	size_t size;
};

static void put(struct line *line, const char *format, ...) __attribute__((format(printf, 2, 3)));

static void put(struct line *line, const char *format, ...)
{
	va_list arguments;
	va_start(arguments, format);
	size_t room = LINE - line->size;
	int wrote = vsnprintf(line->text + line->size, room, format, arguments);
	va_end(arguments);
	if (wrote > 0)
		line->size += (size_t)wrote < room ? (size_t)wrote : room - 1;
}

/* At most `most` bytes of text, without control characters or others that are not ASCII: no text can forge a line. quoted: as it stands
 * between the quotes of JSON. */
static void put_escaped(struct line *line, const char *text, size_t most, bool quoted)
{
	for (size_t i = 0; i < most && text[i]; i++) {
		unsigned char c = (unsigned char)text[i];
		if (quoted && (c == '"' || c == '\\'))
			put(line, "\\%c", c);
		else if (c < 0x20 || c >= 0x7f)
			put(line, "\\u%04x", c);
		else
			put(line, "%c", c);
	}
}

/* As in JSON, in both formats. */
static void put_quoted(struct line *line, const char *text, size_t most)
{
	put(line, "\"");
	put_escaped(line, text, most, true);
	put(line, "\"");
}

static void put_time(struct line *line)
{
	struct timespec now;
	struct tm utc;
	char text[32];
	clock_gettime(CLOCK_REALTIME, &now);
	gmtime_r(&now.tv_sec, &utc);
	strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &utc);
	put(line, "%s.%03ldZ", text, now.tv_nsec / 1000000);
}

/* A pipe that polls as writable takes a line whole: LINE is less than PIPE_BUF. */
static bool has_room(int fd)
{
	struct pollfd room = {.fd = fd, .events = POLLOUT};
	return poll(&room, 1, 0) == 1 && (room.revents & POLLOUT);
}

/* Lock held. A line that cannot be written is lost: there is nowhere to report it to. */
static void write_line(const struct gnpd_log *log, struct line *line)
{
	if (line->size > LINE - 2)
		line->size = LINE - 2;
	line->text[line->size++] = '\n';
	ssize_t ignored = write(log->fd, line->text, line->size);
	(void)ignored;
}

static void event_line(const struct gnpd_log *log, enum gnpd_log_level level, const char *text, struct line *line)
{
	const char *name = gnpd_log_level_name(level);
	if (log->format == GNPD_LOG_JSON) {
		put(line, "{\"time\":\"");
		put_time(line);
		put(line, "\",\"level\":\"%s\",\"event\":\"message\",\"message\":", name);
		put_quoted(line, text, MESSAGE);
		put(line, "}");
	} else {
		put_time(line);
		put(line, " %s: ", name);
		put_escaped(line, text, MESSAGE, false);
	}
}

/* Lock held. */
static void report_dropped(struct gnpd_log *log)
{
	char text[64];
	struct line line = {.size = 0};
	snprintf(text, sizeof text, "%zu log lines were dropped: nobody read them", log->dropped);
	event_line(log, GNPD_LOG_WARNING, text, &line);
	write_line(log, &line);
	log->dropped = 0;
}

/* A log nobody reads must not stop the server, which writes it from the threads that serve sockets. */
static void flush(struct gnpd_log *log, struct line *line)
{
	pthread_mutex_lock(&log->lock);
	if (log->dropped && has_room(log->fd))
		report_dropped(log);
	if (has_room(log->fd))
		write_line(log, line);
	else
		log->dropped++;
	pthread_mutex_unlock(&log->lock);
}

static void access_json(struct line *line, const struct gnpd_access *access)
{
	put(line, "{\"time\":\"");
	put_time(line);
	put(line, "\",\"level\":\"info\",\"event\":\"request\",\"request_id\":");
	put_quoted(line, access->id, SENT);
	put(line, ",\"remote\":\"%s\",\"principal\":\"%s\",\"method\":", access->remote, access->principal);
	put_quoted(line, access->method, SENT);
	put(line, ",\"path\":");
	put_quoted(line, access->path, SENT);
	put(line, ",\"status\":%d,\"code\":\"%s\",\"bytes_in\":%zu,\"bytes_out\":%zu,\"points\":%zu,\"seconds\":%.6f,"
	    "\"waited_seconds\":%.6f}", access->status, access->code_name, access->bytes_in, access->bytes_out,
	    access->points, access->seconds, access->waited);
}

static void access_text(struct line *line, const struct gnpd_access *access)
{
	put_time(line);
	put(line, " %s ", access->remote);
	put_quoted(line, access->method, SENT);
	put(line, " ");
	put_quoted(line, access->path, SENT);
	put(line, " %d %s in=%zu out=%zu points=%zu seconds=%.6f waited=%.6f id=", access->status, access->code_name,
	    access->bytes_in, access->bytes_out, access->points, access->seconds, access->waited);
	put_quoted(line, access->id, SENT);
	if (access->principal[0])
		put(line, " principal=%s", access->principal);
}

void gnpd_log_init(struct gnpd_log *log, enum gnpd_log_format format, enum gnpd_log_level level, int fd)
{
	*log = (struct gnpd_log){.format = format, .fd = fd};
	atomic_init(&log->level, (int)level);
	pthread_mutex_init(&log->lock, NULL);
}

void gnpd_log_fini(struct gnpd_log *log)
{
	pthread_mutex_destroy(&log->lock);
}

bool gnpd_log_wants(struct gnpd_log *log, enum gnpd_log_level level)
{
	return (int)level <= atomic_load(&log->level);
}

void gnpd_log_access(struct gnpd_log *log, const struct gnpd_access *access)
{
	if (!gnpd_log_wants(log, GNPD_LOG_INFO))
		return;
	struct line line = {.size = 0};
	if (log->format == GNPD_LOG_JSON)
		access_json(&line, access);
	else
		access_text(&line, access);
	flush(log, &line);
}

void gnpd_log_event(struct gnpd_log *log, enum gnpd_log_level level, const char *format, ...)
{
	char text[MESSAGE];
	struct line line = {.size = 0};
	va_list arguments;
	if (!gnpd_log_wants(log, level))
		return;
	va_start(arguments, format);
	vsnprintf(text, sizeof text, format, arguments);
	va_end(arguments);
	event_line(log, level, text, &line);
	flush(log, &line);
}
