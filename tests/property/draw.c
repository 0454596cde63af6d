/* Requests drawn from the table of operations: every parameter left out, inside its range, at its ends and beyond. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "core/base/random.h"
#include "proto/file/file.h"
#include "proto/file/formats.h"
#include "proto/operation/operations.h"
#include "tests/property/spec.h"
#include "tests/property/zoo.h"

struct draw {
	struct gnp_random random;
	const char *const *models;
	struct spec *spec;
	size_t columns; /* of inputs */
	bool wild; /* what must be refused is drawn as well */
};

static size_t below(struct draw *draw, size_t bound)
{
	return (size_t)gnp_random_below(&draw->random, bound);
}

static bool once_in(struct draw *draw, size_t times)
{
	return below(draw, times) == 0;
}

static const char *one_of(struct draw *draw, const char *const *names)
{
	size_t count = 0;
	while (names[count])
		count++;
	return names[below(draw, count)];
}

static void set(struct draw *draw, const char *name, const char *format, ...) __attribute__((format(printf, 3, 4)));
static void set(struct draw *draw, const char *name, const char *format, ...)
{
	char text[SPEC_VALUE];
	va_list arguments;
	va_start(arguments, format);
	vsnprintf(text, sizeof text, format, arguments);
	va_end(arguments);
	spec_set(draw->spec, name, text);
}

/* Between, by ratio where the range has no zero within. */
static double between(struct draw *draw, double low, double high)
{
	double t = gnp_random_uniform(&draw->random);
	if (low > 0)
		return low * pow(high / low, t);
	return low + (high - low) * (once_in(draw, 2) ? t : t * t * t * t * t * t);
}

static void draw_number(struct draw *draw, const struct gnp_parameter *p)
{
	bool whole = p->type == GNP_PARAMETER_INTEGER;
	double least = p->minimum == GNP_ABOVE_ZERO ? 1e-12 : p->minimum, most = p->maximum;
	double usual = between(draw, least, fmin(most, whole ? 64 : 10)), any = between(draw, least, most);
	double chosen[] = {usual, usual, usual, usual, usual, any, p->minimum, most, p->minimum - 1, most * 2 + 1};
	double value = chosen[below(draw, draw->wild ? 10 : 8)];
	if (p->type == GNP_PARAMETER_AUTO && once_in(draw, 4))
		set(draw, p->name, "auto");
	else
		set(draw, p->name, "%.9g", whole ? fmin(fmax(floor(value), -2e9), 2e9) : value);
}

/* Some of the names, each once. */
static void draw_set(struct draw *draw, const char *word, const struct gnp_operation *operation)
{
	char list[SPEC_VALUE] = "";
	size_t length = 0, rare = draw->wild ? 1 : 1 + below(draw, 4);
	for (size_t i = 0; i < operation->output_count && length + GNP_TENSOR_NAME_MAX + 2 < sizeof list; i++)
		if (below(draw, 4) >= rare && (draw->wild || !strstr(operation->outputs[i].name, "_stderr") || once_in(draw, 20)))
			length += (size_t)snprintf(list + length, sizeof list - length, "%s%s", length ? "," : "", operation->outputs[i].name);
	if (!length)
		snprintf(list, sizeof list, "%s", operation->outputs[below(draw, operation->output_count)].name);
	set(draw, word, "%s", list);
}

static void draw_parameter(struct draw *draw, const struct gnp_operation *operation, const struct gnp_parameter *p)
{
	switch (p->type) {
	case GNP_PARAMETER_BOOL: set(draw, p->name, "%s", once_in(draw, 2) ? "true" : "false"); break;
	case GNP_PARAMETER_CHOICE: set(draw, p->name, "%s", draw->wild && once_in(draw, 8) ? "nothing" : one_of(draw, p->choices)); break;
	case GNP_PARAMETER_MODEL:
		set(draw, p->name, "%s", draw->wild && once_in(draw, 8) ? "nobody" : once_in(draw, 4) || !draw->models[0] ? "auto" : one_of(draw, draw->models));
		break;
	case GNP_PARAMETER_SET:
		if (once_in(draw, 3))
			set(draw, p->name, "all");
		else
			draw_set(draw, p->name, operation);
		break;
	default: draw_number(draw, p);
	}
}

/* Long iterations are drawn seldom: what they do in the hundredth step they do in the second. */
static void shorten(struct draw *draw)
{
	static const char *const costly[] = {"steps", "count", "iterations"};
	for (size_t i = 0; i < sizeof costly / sizeof *costly; i++)
		if (spec_number(draw->spec, costly[i], 0) > 6 && !once_in(draw, 8))
			set(draw, costly[i], "%zu", 1 + below(draw, 6));
}

static void draw_input(struct draw *draw, const struct gnp_tensor_info *info)
{
	char word[SPEC_NAME];
	snprintf(word, sizeof word, "in:%s", info->name);
	if (info->datatype == GNP_BOOL)
		set(draw, word, "%s", zoo_masks[below(draw, draw->wild ? 5 : 4)]);
	else
		set(draw, word, "%s:%zu", zoo_values[below(draw, draw->wild ? 8 : 7)],
		    draw->wild && once_in(draw, 8) ? 0 : info->shape[1] > 0 ? (size_t)info->shape[1] : draw->columns);
}

static void draw_inputs(struct draw *draw, const struct gnp_operation *operation)
{
	for (size_t i = 0; i < operation->input_count; i++) {
		const struct gnp_tensor_info *info = &operation->inputs[i];
		if (strcmp(info->name, "points") != 0 && strcmp(info->name, "normals") != 0 && (info->optional ? once_in(draw, 2) : !once_in(draw, 60)))
			draw_input(draw, info);
	}
}

static void draw_cloud(struct draw *draw)
{
	static const char *const types[] = {"FP64", "FP64", "FP32", "FP32", "INT16", "FP16"};
	static const double most[] = {90, 150, 150, 400, 800, 2000};
	size_t known = 0;
	while (zoo_clouds[known + 1])
		known++;
	set(draw, "cloud", "%s", zoo_clouds[below(draw, known + draw->wild)]);
	set(draw, "n", "%.0f", floor(between(draw, once_in(draw, 6) ? 1 : 70, most[below(draw, sizeof most / sizeof *most)] + 0.999)));
	set(draw, "seed", "%zu", below(draw, 1000));
	if (once_in(draw, 3))
		set(draw, "normals", "%s", zoo_normals[below(draw, draw->wild ? 6 : 4)]);
	if (once_in(draw, 4))
		set(draw, "shake", "%.3g", between(draw, 1e-4, 0.3));
	if (once_in(draw, 8))
		set(draw, "scale", "1e%d", once_in(draw, 3) ? (int)below(draw, draw->wild ? 601 : 201) - (draw->wild ? 300 : 100) : (int)below(draw, 41) - 20);
	if (once_in(draw, 10))
		set(draw, "moved", "1e%d", (int)below(draw, 9));
	if (once_in(draw, 3))
		set(draw, "type", "%s", types[below(draw, sizeof types / sizeof *types)]);
}

static const char *const ways[] = {"v2", "v1", NULL};

void spec_draw(uint64_t seed, uint64_t index, const char *const *models, struct spec *spec)
{
	struct draw draw = {.models = models, .spec = spec};
	size_t operations = 0, formats = 0;
	gnp_random_seed(&draw.random, seed, index);
	*spec = (struct spec){.count = 0};
	while (gnp_operation_at(operations))
		operations++;
	const struct gnp_operation *operation = gnp_operation_at(below(&draw, operations));
	draw.wild = once_in(&draw, 6);
	draw.columns = 1 + below(&draw, 3);
	set(&draw, "op", "%s", operation->name);
	draw_cloud(&draw);
	draw_inputs(&draw, operation);
	size_t rare = 1 + below(&draw, 6);
	for (size_t i = 0; i < operation->parameter_count; i++)
		if (below(&draw, 6) >= rare)
			draw_parameter(&draw, operation, &operation->parameters[i]);
	shorten(&draw);
	if (once_in(&draw, 6))
		draw_set(&draw, "out", operation);
	while (gnp_format_at(formats))
		formats++;
	set(&draw, "format", "%s", gnp_format_at(below(&draw, formats))->name);
	set(&draw, "via", "%s", one_of(&draw, ways));
}
