#include "server/jobs/job_record.h"

#include <inttypes.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/parse/hex.h"

enum kind { TEXT, STRING, NUMBER, TIME, STATE, STATUS, FLAG };

struct member {
	const char *name;
	enum kind kind;
	size_t offset, capacity; /* capacity: of TEXT, its NUL included */
	bool needed;
};

#define AT(member) offsetof(struct gnpd_job_record, member)
#define TEXT_AT(member) TEXT, AT(member), sizeof((struct gnpd_job_record *)0)->member

static const struct member members[] = {
	{"id", TEXT_AT(id), true},
	{"operation", TEXT_AT(operation), true},
	{"codec", TEXT_AT(codec), true},
	{"principal", TEXT_AT(principal), false},
	{"key", TEXT_AT(key), false},
	{"fingerprint", TEXT_AT(fingerprint), true},
	{"query", STRING, AT(query), 0, false},
	{"content_type", STRING, AT(content_type), 0, false},
	{"content_encoding", STRING, AT(content_encoding), 0, false},
	{"accept", STRING, AT(accept), 0, false},
	{"inference_length", STRING, AT(inference_length), 0, false},
	{"body_bytes", NUMBER, AT(body_bytes), 0, true},
	{"state", STATE, AT(state), 0, true},
	{"cancelled", FLAG, AT(cancelled), 0, false},
	{"attempts", NUMBER, AT(attempts), 0, true},
	{"company", FLAG, AT(company), 0, false},
	{"created", TIME, AT(created), 0, true},
	{"started", TIME, AT(started), 0, true},
	{"finished", TIME, AT(finished), 0, true},
	{"error", STATUS, AT(error), 0, true},
	{"error_text", TEXT_AT(error_text), false},
	{"result_bytes", NUMBER, AT(result_bytes), 0, true},
	{"result_type", TEXT_AT(result_type), false},
	{"result_inference_length", TEXT_AT(result_inference_length), false},
	{"result_timing", TEXT_AT(result_timing), false},
	{"result_warnings", STRING, AT(result_warnings), 0, false},
	{"result_parameters", STRING, AT(result_parameters), 0, false},
	{"result_hash", TEXT_AT(result_hash), false},
};
enum { MEMBERS = sizeof members / sizeof members[0] };

static const char *const states[GNPD_JOB_STATES] = {"queued", "running", "succeeded", "failed", "cancelled", "expired"};

static const char magic[] = "gnpd-job 1 ";

const char *gnpd_job_state_name(enum gnpd_job_state state)
{
	return (unsigned)state < GNPD_JOB_STATES ? states[state] : "unknown";
}

bool gnpd_job_state_find(const char *name, enum gnpd_job_state *state)
{
	for (int i = 0; i < GNPD_JOB_STATES; i++) {
		if (strcmp(states[i], name) == 0) {
			*state = (enum gnpd_job_state)i;
			return true;
		}
	}
	return false;
}

bool gnpd_job_state_is_final(enum gnpd_job_state state)
{
	return state != GNPD_JOB_QUEUED && state != GNPD_JOB_RUNNING;
}

bool gnpd_job_id_valid(const char *text)
{
	return strlen(text) == GNPD_JOB_ID && strspn(text, "0123456789abcdef") == GNPD_JOB_ID;
}

void gnpd_job_record_clear(struct gnpd_job_record *record)
{
	free(record->query);
	free(record->content_type);
	free(record->content_encoding);
	free(record->accept);
	free(record->inference_length);
	free(record->result_warnings);
	free(record->result_parameters);
	memset(record, 0, sizeof *record);
}

/* ---- Writing ---- */

static bool is_plain(unsigned char c)
{
	return c > 0x20 && c < 0x7f && c != '%';
}

static gnp_status write_text(const char *name, const char *text, struct gnp_buffer *buffer, struct gnp_error *error)
{
	gnp_status status = gnp_buffer_printf(buffer, error, "%s ", name);
	for (; *text && status == GNP_OK; text++) {
		unsigned char c = (unsigned char)*text;
		status = is_plain(c) ? gnp_buffer_append(buffer, text, 1, error) : gnp_buffer_printf(buffer, error, "%%%02x", c);
	}
	return status == GNP_OK ? gnp_buffer_append(buffer, "\n", 1, error) : status;
}

static gnp_status write_member(const struct member *member, const void *field, struct gnp_buffer *buffer, struct gnp_error *error)
{
	const char *text = NULL;
	switch (member->kind) {
	case NUMBER: return gnp_buffer_printf(buffer, error, "%s %" PRIu64 "\n", member->name, *(const uint64_t *)field);
	case TIME: return gnp_buffer_printf(buffer, error, "%s %" PRId64 "\n", member->name, *(const int64_t *)field);
	case STATE: text = gnpd_job_state_name(*(const enum gnpd_job_state *)field); break;
	case STATUS: text = gnp_status_name(*(const gnp_status *)field); break;
	case FLAG: text = *(const bool *)field ? "1" : NULL; break;
	case TEXT: text = *(const char *)field ? field : NULL; break;
	case STRING: memcpy(&text, field, sizeof text); break;
	}
	return text ? write_text(member->name, text, buffer, error) : GNP_OK;
}

gnp_status gnpd_job_record_write(const struct gnpd_job_record *record, struct gnp_buffer *buffer, struct gnp_error *error)
{
	struct gnp_buffer body = {0};
	char hash[GNP_SHA256_TEXT];
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < MEMBERS && status == GNP_OK; i++)
		status = write_member(&members[i], (const char *)record + members[i].offset, &body, error);
	gnp_sha256_text((const void *const[]){body.data}, &body.size, 1, hash);
	if (status == GNP_OK)
		status = gnp_buffer_printf(buffer, error, "%s%s\n", magic, hash);
	if (status == GNP_OK)
		status = gnp_buffer_append(buffer, body.data, body.size, error);
	gnp_buffer_clear(&body);
	return status;
}

/* ---- Reading ---- */

/* Decodes length bytes into text, which has room for as many and a NUL; false for what no writer writes. */
static bool decode_text(const char *value, size_t length, char *text)
{
	for (size_t i = 0; i < length; i++) {
		unsigned char c = (unsigned char)value[i];
		if (c == '%') {
			int high = i + 2 < length ? gnpd_hex_digit(value[i + 1]) : -1, low = high < 0 ? -1 : gnpd_hex_digit(value[i + 2]);
			if (low < 0 || (high | low) == 0)
				return false;
			c = (unsigned char)(high << 4 | low);
			i += 2;
		} else if (!is_plain(c)) {
			return false;
		}
		*text++ = (char)c;
	}
	*text = '\0';
	return true;
}

static bool read_number(const char *text, uint64_t most, uint64_t *number)
{
	uint64_t value = 0;
	if (!*text)
		return false;
	for (; *text; text++) {
		if (*text < '0' || *text > '9' || value > (most - (uint64_t)(*text - '0')) / 10)
			return false;
		value = 10 * value + (uint64_t)(*text - '0');
	}
	*number = value;
	return true;
}

static bool read_status(const char *text, gnp_status *status)
{
	for (int i = 0; i < GNP_STATUS_COUNT; i++) {
		if (strcmp(gnp_status_name((gnp_status)i), text) == 0) {
			*status = (gnp_status)i;
			return true;
		}
	}
	return false;
}

/* text: decoded; given up where it becomes the record's (*taken). */
static bool set_member(const struct member *member, void *field, char *text, bool *taken)
{
	uint64_t number = 0;
	*taken = false;
	switch (member->kind) {
	case NUMBER: return read_number(text, UINT64_MAX, field);
	case TIME:
		if (!read_number(text, INT64_MAX, &number))
			return false;
		*(int64_t *)field = (int64_t)number;
		return true;
	case STATE: return gnpd_job_state_find(text, field);
	case STATUS: return read_status(text, field);
	case FLAG:
		*(bool *)field = strcmp(text, "1") == 0;
		return *(bool *)field;
	case TEXT:
		if (!*text || strlen(text) >= member->capacity)
			return false;
		memcpy(field, text, strlen(text) + 1);
		return true;
	case STRING:
		memcpy(field, &text, sizeof text);
		*taken = true;
		return true;
	}
	return false;
}

static const struct member *member_find(const char *name, size_t length)
{
	for (size_t i = 0; i < MEMBERS; i++)
		if (strlen(members[i].name) == length && memcmp(members[i].name, name, length) == 0)
			return &members[i];
	return NULL;
}

static gnp_status damaged(const char *line, size_t length, const char *what, struct gnp_error *error)
{
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "record: %s in the line \"%.*s\"", what, length < 60 ? (int)length : 60, line);
}

/* line: length bytes without the newline. seen: a flag for each member. */
static gnp_status parse_line(const char *line, size_t length, struct gnpd_job_record *record, bool seen[MEMBERS], struct gnp_error *error)
{
	const char *space = memchr(line, ' ', length);
	if (!space)
		return damaged(line, length, "no value", error);
	const struct member *member = member_find(line, (size_t)(space - line));
	if (!member)
		return damaged(line, length, "unknown member", error);
	if (seen[member - members])
		return damaged(line, length, "a member that was there before", error);
	seen[member - members] = true;
	size_t size = length - (size_t)(space + 1 - line);
	char *text = malloc(size + 1);
	bool taken = false;
	if (!text)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "record: no memory for %zu bytes", size);
	bool good = decode_text(space + 1, size, text) && set_member(member, (char *)record + member->offset, text, &taken);
	if (!taken)
		free(text);
	return good ? GNP_OK : damaged(line, length, "a value that is none", error);
}

static gnp_status parse_lines(const char *data, size_t size, struct gnpd_job_record *record, bool seen[MEMBERS], struct gnp_error *error)
{
	const char *end = data + size;
	gnp_status status = GNP_OK;
	while (data < end && status == GNP_OK) {
		const char *newline = memchr(data, '\n', (size_t)(end - data));
		if (!newline)
			return damaged(data, (size_t)(end - data), "no end", error);
		status = parse_line(data, (size_t)(newline - data), record, seen, error);
		data = newline + 1;
	}
	return status;
}

/* What members say of each other. */
static gnp_status check_record(const struct gnpd_job_record *record, const bool seen[MEMBERS], struct gnp_error *error)
{
	for (size_t i = 0; i < MEMBERS; i++)
		if (members[i].needed && !seen[i])
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "record: \"%s\" is missing", members[i].name);
	if (!gnpd_job_id_valid(record->id))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "record: id: got \"%.60s\", need %d hexadecimal digits", record->id, GNPD_JOB_ID);
	if (gnpd_job_state_is_final(record->state) != (record->finished > 0))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "record: state %s, finished %" PRId64, gnpd_job_state_name(record->state),
		                     record->finished);
	if (gnpd_job_state_is_final(record->state) && record->cancelled)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "record: state %s, and it is to be cancelled",
		                     gnpd_job_state_name(record->state));
	if (record->state == GNPD_JOB_SUCCEEDED && (!*record->result_hash || !*record->result_type))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "record: state succeeded without a result");
	if (record->state == GNPD_JOB_FAILED && record->error == GNP_OK)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "record: state failed without an error");
	return GNP_OK;
}

gnp_status gnpd_job_record_parse(const char *data, size_t size, struct gnpd_job_record *out, struct gnp_error *error)
{
	enum { HEAD = sizeof magic - 1 + GNP_SHA256_TEXT - 1 + 1 };
	struct gnpd_job_record record = {0};
	bool seen[MEMBERS] = {false};
	char hash[GNP_SHA256_TEXT];
	if (size < HEAD || memcmp(data, magic, sizeof magic - 1) != 0 || data[HEAD - 1] != '\n')
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "record: does not begin with \"%s\" and a checksum", magic);
	const char *body = data + HEAD;
	size_t rest = size - HEAD;
	gnp_sha256_text((const void *const[]){body}, &rest, 1, hash);
	if (memcmp(data + sizeof magic - 1, hash, GNP_SHA256_TEXT - 1) != 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "record: the checksum is wrong");
	gnp_status status = parse_lines(body, rest, &record, seen, error);
	if (status == GNP_OK)
		status = check_record(&record, seen, error);
	if (status == GNP_OK)
		*out = record;
	else
		gnpd_job_record_clear(&record);
	return status;
}
