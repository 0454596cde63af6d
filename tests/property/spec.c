#include "tests/property/spec.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool spec_is_own(const char *name)
{
	static const char *const own[] = {"op", "cloud", "n", "seed", "scale", "moved", "shake", "type", "normals", "out", "format", "via"};
	for (size_t i = 0; i < sizeof own / sizeof *own; i++)
		if (strcmp(name, own[i]) == 0)
			return true;
	return strncmp(name, "in:", 3) == 0;
}

bool spec_parse(const char *text, struct spec *spec)
{
	*spec = (struct spec){.count = 0};
	while (*(text += strspn(text, " \n"))) {
		size_t length = strcspn(text, " \n"), name = strcspn(text, "=");
		if (name >= length || name >= SPEC_NAME || length - name > SPEC_VALUE || spec->count == SPEC_WORDS)
			return false;
		snprintf(spec->word[spec->count].name, SPEC_NAME, "%.*s", (int)name, text);
		snprintf(spec->word[spec->count++].value, SPEC_VALUE, "%.*s", (int)(length - name - 1), text + name + 1);
		text += length;
	}
	return spec_get(spec, "op", NULL) != NULL;
}

void spec_write(const struct spec *spec, char text[SPEC_TEXT])
{
	size_t length = 0;
	text[0] = '\0';
	for (size_t i = 0; i < spec->count && length < SPEC_TEXT; i++)
		length += (size_t)snprintf(text + length, SPEC_TEXT - length, "%s%s=%s", i ? " " : "", spec->word[i].name, spec->word[i].value);
}

static size_t place_of(const struct spec *spec, const char *name)
{
	size_t i = 0;
	while (i < spec->count && strcmp(spec->word[i].name, name) != 0)
		i++;
	return i;
}

const char *spec_get(const struct spec *spec, const char *name, const char *otherwise)
{
	size_t at = place_of(spec, name);
	return at < spec->count ? spec->word[at].value : otherwise;
}

double spec_number(const struct spec *spec, const char *name, double otherwise)
{
	const char *text = spec_get(spec, name, NULL);
	return text ? strtod(text, NULL) : otherwise;
}

void spec_set(struct spec *spec, const char *name, const char *value)
{
	size_t at = place_of(spec, name);
	if (!value && at < spec->count) {
		memmove(&spec->word[at], &spec->word[at + 1], (spec->count - at - 1) * sizeof spec->word[0]);
		spec->count--;
	}
	if (!value || (at == spec->count && spec->count == SPEC_WORDS))
		return;
	spec->count += at == spec->count;
	snprintf(spec->word[at].name, SPEC_NAME, "%s", name);
	snprintf(spec->word[at].value, SPEC_VALUE, "%s", value);
}
