#include "core/model/model_keys.h"

#include <ctype.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum kind { CHOICE, COUNT, NUMBER, TEXT, SHELLS };

/* Files that must have a key: those of these heads, or those of any with a trunk, or none. */
enum {
	POOLED = 1 << GNP_HEAD_POOLED, PROJECTION = 1 << GNP_HEAD_PROJECTION, WEIGHTED = 1 << GNP_HEAD_WEIGHTED,
	PATCHED = POOLED | PROJECTION, EVERY = PATCHED | WEIGHTED, OPTIONAL = 0
};
enum { TRUNK = 1 << GNP_HEADS };

struct key {
	const char *name;
	enum kind kind;
	size_t offset; /* in a description, of an unsigned or an enumeration of that size, double or const char *; not of shells */
	unsigned heads;
	double minimum, maximum;    /* of counts and numbers */
	const char *(*choice)(unsigned i); /* of choices: the name of i, NULL past the last */
};

static const char *format_name(unsigned i)
{
	return i == 0 ? "1" : NULL;
}

static const char *trunk_name(unsigned i)
{
	return gnp_trunk_name((enum gnp_trunk_kind)i);
}

static const char *head_name(unsigned i)
{
	return gnp_head_name((enum gnp_head_kind)i);
}

#define ARCHITECTURE(member) offsetof(struct gnp_model_description, architecture.member)
#define RECIPE(member) offsetof(struct gnp_model_description, recipe.member)

/* The one table of keys, in the order they are read: those that tell which others are needed come first. The ranges of
 * the architecture are gnp_architecture_layout's to check. */
static const struct key keys[] = {
	{"gnp_format", CHOICE, offsetof(struct gnp_model_description, format), EVERY, 0, 0, format_name},
	{"head", CHOICE, ARCHITECTURE(head), EVERY, 0, 0, head_name},
	{"trunk", CHOICE, ARCHITECTURE(trunk), EVERY, 0, 0, trunk_name},
	{"features", COUNT, ARCHITECTURE(features), TRUNK, 1, UINT_MAX, NULL},
	{"width", COUNT, ARCHITECTURE(width), TRUNK, 1, UINT_MAX, NULL},
	{"channels", COUNT, ARCHITECTURE(channels), TRUNK, 1, UINT_MAX, NULL},
	{"neurons", COUNT, ARCHITECTURE(neurons), TRUNK, 1, UINT_MAX, NULL},
	{"layers", COUNT, ARCHITECTURE(layers), TRUNK, 1, UINT_MAX, NULL},
	{"quadrature", COUNT, ARCHITECTURE(quadrature), TRUNK, 1, UINT_MAX, NULL},
	{"head_width", COUNT, ARCHITECTURE(head_width), EVERY, 1, UINT_MAX, NULL},
	{"outputs", COUNT, ARCHITECTURE(outputs), EVERY, 1, UINT_MAX, NULL},
	{"node_width", COUNT, ARCHITECTURE(node_width), WEIGHTED, 1, UINT_MAX, NULL},
	{"frame_width", COUNT, ARCHITECTURE(frame_width), WEIGHTED, 1, UINT_MAX, NULL},
	{"shells", SHELLS, 0, PROJECTION, 1, UINT_MAX, NULL},
	{"ridge", NUMBER, ARCHITECTURE(ridge), PROJECTION, 1e-15, 1, NULL},
	{"k", COUNT, RECIPE(k), PATCHED, 12, 500, NULL},
	{"buffer", NUMBER, RECIPE(buffer), PATCHED, 1, 4, NULL},
	{"height_scale", NUMBER, RECIPE(height_scale), PATCHED, 0.01, 100, NULL},
	{"delta0_ratio", NUMBER, RECIPE(delta0_ratio), OPTIONAL, 1e-6, 100, NULL},
	{"delta0", NUMBER, RECIPE(delta0), OPTIONAL, 1e-12, 1e12, NULL},
	{"regime", TEXT, offsetof(struct gnp_model_description, regime), EVERY, 0, 0, NULL},
};
enum { KEYS = sizeof keys / sizeof keys[0] };
_Static_assert(sizeof keys / sizeof *keys <= (size_t)GNP_MODEL_KEYS_MAX, "writers have room for every key");

/* Keys for people: any text, after one of these. "format" is what PyTorch's writer adds by itself. */
static const char *const free_keys[] = {"format", "note", "training_", "validation_"};

static gnp_status refuse(const struct gnp_safetensors *file, const struct key *key, const char *got,
                         struct gnp_error *error)
{
	char list[120] = "";
	for (unsigned i = 0; key->kind == CHOICE && key->choice(i); i++) {
		size_t length = strlen(list);
		snprintf(list + length, sizeof list - length, "%s%s", i ? " or " : "", key->choice(i));
	}
	if (key->kind == SHELLS)
		snprintf(list, sizeof list, "1..%d integers with commas between", GNP_SHELLS_MAX);
	if (key->kind == COUNT)
		snprintf(list, sizeof list, key->maximum < UINT_MAX ? "an integer of %.0f..%.0f" : "an integer of at least %.0f", key->minimum,
		         key->maximum);
	if (key->kind == NUMBER)
		snprintf(list, sizeof list, "a number of %g..%g", key->minimum, key->maximum);
	if (key->kind == TEXT)
		snprintf(list, sizeof list, "1..%d of A-Z a-z 0-9 _ - .", GNP_MODEL_NAME_MAX);
	return gnp_safetensors_refuse(file, error, "metadata \"%s\": got %s%.40s%s, need %s", key->name, got ? "\"" : "",
	                          got ? got : "none", got ? "\"" : "", list);
}

bool gnp_model_name_fits(const char *name)
{
	static const char allowed[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_.-";
	size_t length = strlen(name);
	return length >= 1 && length <= GNP_MODEL_NAME_MAX && strspn(name, allowed) == length && isalnum((unsigned char)name[0]);
}

/* Whether a network must have the key. */
static bool is_asked(const struct key *key, const struct gnp_architecture *architecture)
{
	return key->heads == TRUNK ? architecture->trunk != GNP_TRUNK_NONE : key->heads & 1u << architecture->head;
}

/* ---- From metadata ---- */

/* "30,50,80" */
static bool read_shells(const char *text, struct gnp_architecture *architecture)
{
	architecture->shells = 0;
	while (isdigit((unsigned char)*text) && architecture->shells < GNP_SHELLS_MAX) {
		char *end;
		unsigned long value = strtoul(text, &end, 10);
		architecture->shell[architecture->shells++] = value < UINT_MAX ? (unsigned)value : UINT_MAX;
		if (*end == '\0')
			return true;
		if (*end != ',')
			return false;
		text = end + 1;
	}
	return false;
}

static bool read_number(const struct key *key, const char *text, double *value)
{
	const char *allowed = key->kind == COUNT ? "0123456789" : "0123456789.eE+-";
	char *end;
	if (!*text || text[strspn(text, allowed)] != '\0')
		return false;
	*value = strtod(text, &end);
	return *end == '\0' && *value >= key->minimum && *value <= key->maximum;
}

/* False when the text is no value of the key. */
static bool read_value(const struct key *key, const char *text, struct gnp_model_description *out)
{
	void *field = (char *)out + key->offset;
	double number = 0;
	if (key->kind == SHELLS)
		return read_shells(text, &out->architecture);
	if (key->kind == TEXT) {
		*(const char **)field = text;
		return gnp_model_name_fits(text);
	}
	if (key->kind == CHOICE) {
		unsigned choice = 0;
		while (key->choice(choice) && strcmp(key->choice(choice), text) != 0)
			choice++;
		memcpy(field, &choice, sizeof choice);
		return key->choice(choice) != NULL;
	}
	if (!read_number(key, text, &number))
		return false;
	if (key->kind == COUNT)
		*(unsigned *)field = (unsigned)number;
	else
		*(double *)field = number;
	return true;
}

static gnp_status read_key(const struct gnp_safetensors *file, const struct key *key, struct gnp_model_description *out,
                           struct gnp_error *error)
{
	const char *text = gnp_safetensors_metadata_find(file, key->name);
	const struct gnp_architecture *a = &out->architecture;
	bool asked = is_asked(key, a), trunk = key->heads == TRUNK;
	if (text && key->heads && !asked)
		return gnp_safetensors_refuse(file, error, "metadata \"%s\": got \"%.40s\", need none with the %s %s",
		                              key->name, text, trunk ? "trunk" : "head",
		                              trunk ? gnp_trunk_name(a->trunk) : gnp_head_name(a->head));
	if (text ? read_value(key, text, out) : !asked)
		return GNP_OK;
	return refuse(file, key, text, error);
}

bool gnp_model_key_known(const char *name)
{
	for (size_t i = 0; i < KEYS; i++)
		if (strcmp(keys[i].name, name) == 0)
			return true;
	for (size_t i = 0; i < sizeof free_keys / sizeof free_keys[0]; i++)
		if (strncmp(free_keys[i], name, strlen(free_keys[i])) == 0)
			return true;
	return false;
}

/* Models of patches need one of the two, others none: what is wrong, or NULL. */
static const char *delta0_fault(const struct gnp_model_description *description)
{
	static const char *const faults[2][3] = {{NULL, "got one, need none of them", "got both, need none of them"},
	                                         {"got none, need one of them", NULL, "got both, need one of them"}};
	int have = (description->recipe.delta0 > 0) + (description->recipe.delta0_ratio > 0);
	return faults[(PATCHED & 1u << description->architecture.head) != 0][have];
}

gnp_status gnp_model_keys_read(const struct gnp_safetensors *file, struct gnp_model_description *out,
                               struct gnp_error *error)
{
	const struct gnp_safetensors_metadata *entry;
	gnp_status status = GNP_OK;
	*out = (struct gnp_model_description){.format = 0};
	for (size_t i = 0; i < KEYS && status == GNP_OK; i++)
		status = read_key(file, &keys[i], out, error);
	for (size_t i = 0; status == GNP_OK && (entry = gnp_safetensors_metadata_at(file, i)); i++)
		if (!gnp_model_key_known(entry->key))
			status = gnp_safetensors_refuse(file, error,
			                                "metadata \"%.64s\": unknown key, need one of weights/README.md", entry->key);
	const char *fault = status == GNP_OK ? delta0_fault(out) : NULL;
	return fault ? gnp_safetensors_refuse(file, error, "metadata \"delta0\" and \"delta0_ratio\": %s", fault) : status;
}

/* ---- To metadata ---- */

/* The shortest text that reads back the same. */
static void write_number(double value, char text[GNP_MODEL_VALUE_TEXT])
{
	char shortest[GNP_MODEL_VALUE_TEXT];
	for (int digits = 15; digits <= 17; digits++) {
		snprintf(shortest, sizeof shortest, "%.*g", digits, value);
		if (strtod(shortest, NULL) == value)
			break;
	}
	memcpy(text, shortest, sizeof shortest);
}

/* False when the description has no value for the key. */
static bool write_value(const struct key *key, const struct gnp_model_description *description,
                        char buffer[GNP_MODEL_VALUE_TEXT], const char **value)
{
	const struct gnp_architecture *architecture = &description->architecture;
	const void *field = (const char *)description + key->offset;
	unsigned count;
	size_t length = 0;
	if (key->heads && !is_asked(key, architecture))
		return false;
	*value = buffer;
	switch (key->kind) {
	case SHELLS:
		for (unsigned i = 0; i < architecture->shells && i < GNP_SHELLS_MAX; i++)
			length += (size_t)snprintf(buffer + length, GNP_MODEL_VALUE_TEXT - length, "%s%u", i ? "," : "", architecture->shell[i]);
		return true;
	case TEXT: *value = *(const char *const *)field; return true;
	case NUMBER: write_number(*(const double *)field, buffer); return key->heads || *(const double *)field != 0;
	default: memcpy(&count, field, sizeof count); break;
	}
	if (key->kind == CHOICE)
		*value = key->choice(count) ? key->choice(count) : "";
	else
		snprintf(buffer, GNP_MODEL_VALUE_TEXT, "%u", count);
	return true;
}

gnp_status gnp_model_keys_write(const char *path, const struct gnp_model_description *description,
                                char buffers[GNP_MODEL_KEYS_MAX][GNP_MODEL_VALUE_TEXT], struct gnp_safetensors_metadata *metadata,
                                size_t *count, struct gnp_error *error)
{
	struct gnp_model_description unused;
	const char *fault = delta0_fault(description);
	size_t made = 0;
	if (fault)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%.120s: metadata \"delta0\" and \"delta0_ratio\": %s", path,
		                     fault);
	for (size_t i = 0; i < KEYS; i++) {
		struct gnp_safetensors_metadata *entry = &metadata[made];
		if (!write_value(&keys[i], description, buffers[i], &entry->value))
			continue;
		if (!read_value(&keys[i], entry->value, &unused))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT,
			                     "%.120s: metadata \"%s\": got \"%.40s\", which no reader takes", path,
			                     keys[i].name, entry->value);
		entry->key = keys[i].name;
		made++;
	}
	*count = made;
	return GNP_OK;
}
