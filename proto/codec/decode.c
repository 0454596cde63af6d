#include "proto/codec/decode.h"

#include <math.h>
#include <string.h>

gnp_status gnp_decode_check_points(const struct gnp_decode *decode, size_t count, struct gnp_error *error)
{
	size_t most = decode->wants.max_points;
	if (most && count > most)
		return gnp_error_set(error, GNP_TOO_LARGE, "points: got %zu, need at most %zu", count, most);
	return GNP_OK;
}

/* PLY's readers put scalar_ before scalars, some once more each time a file goes through them. */
const char *gnp_decode_bare_name(const char *text, size_t *length)
{
	size_t prefix = strlen("scalar_");
	for (; *length > prefix && memcmp(text, "scalar_", prefix) == 0; text += prefix)
		*length -= prefix;
	return text;
}

bool gnp_decode_spells(const char *text, size_t length, const char *name)
{
	text = gnp_decode_bare_name(text, &length);
	return strlen(name) == length && memcmp(text, name, length) == 0;
}

bool gnp_decode_is_extra(const struct gnp_tensor_info *info)
{
	return strcmp(info->name, "points") != 0 && strcmp(info->name, "normals") != 0;
}

const struct gnp_tensor_info *gnp_decode_input(const struct gnp_decode *decode, const char *name)
{
	for (size_t i = 0; i < decode->wants.input_count; i++) {
		const struct gnp_tensor_info *info = &decode->wants.inputs[i];
		if (gnp_decode_is_extra(info) && gnp_decode_spells(name, strlen(name), info->name))
			return info;
	}
	return NULL;
}

gnp_status gnp_decode_check_normal(const char *what, size_t row, const double normal[3], const char *otherwise,
                                   struct gnp_error *error)
{
	double length = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
	if (fabs(length - 1) < 0.05)
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT,
	                     "%s: row %zu: columns 4 to 6 have length %g, need unit normals or %s", what, row, length,
	                     otherwise);
}
