#include "weights/train/any/any_model.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>

#include "core/model/model.h"

enum { NOTES = 12, NOTE_BYTES = 320 };

struct notes {
	size_t count;
	char text[NOTES][NOTE_BYTES];
	struct gnp_safetensors_metadata list[NOTES];
};

static void __attribute__((format(printf, 3, 4))) note(struct notes *notes, const char *key, const char *format, ...)
{
	va_list arguments;
	char *text = notes->text[notes->count];
	va_start(arguments, format);
	vsnprintf(text, NOTE_BYTES, format, arguments);
	va_end(arguments);
	notes->list[notes->count++] = (struct gnp_safetensors_metadata){key, text};
}

static void note_data(const struct gnp_any_options *train, struct notes *notes)
{
	const struct gnp_any_recipe *recipe = &train->recipe;
	note(notes, "training_shapes",
	     "20 %% radial, 38 %% solids, 42 %% rough and facets; of %zu to %zu points",
	     recipe->least, recipe->most);
	note(notes, "training_noise",
	     "30 %% none, 35 %% of 0.003 to 0.5, 35 %% of 0.5 to 5 spacings, %g %% of them along the normals; up to 30 %% "
	     "outliers in a third; normals given in %g %%",
	     100 * recipe->normal_noise, 100 * recipe->given);
}

static void note_watched(const struct gnp_any_end *end, struct notes *notes)
{
	char text[NOTE_BYTES];
	size_t used = 0;
	for (int f = 0; f < GNP_ANY_FIGURES && used < sizeof text; f++)
		used += (size_t)snprintf(text + used, sizeof text - used, "%s%s %.3g", f ? ", " : "",
		                         gnp_any_figure_name((enum gnp_any_figure)f), end->watched[f]);
	note(notes, "training_watched", "%s", text);
}

static void write_notes(const struct gnp_any_plan *plan, const struct gnp_any_end *end, struct notes *notes)
{
	const struct gnp_any_options *train = &plan->run.train;
	unsigned long long steps = end->step - train->frame_steps;
	notes->count = 0;
	note(notes, "training_seed", "%llu", (unsigned long long)train->seed);
	note(notes, "training_steps", "%llu, after %llu for frames", steps, (unsigned long long)train->frame_steps);
	note(notes, "training_patches", "%llu", steps * train->batch);
	note(notes, "training_seconds", "%.0f", end->seconds);
	note_data(train, notes);
	note(notes, "training_rate", "%g to %g, batches of %zu; frames: %g to %g, batches of %zu", train->rate,
	     train->rate * train->last, train->batch, train->frame_rate, train->frame_rate * train->last,
	     train->frame_batch);
	if (!isnan(end->watched[0]))
		note_watched(end, notes);
}

gnp_status gnp_any_model_write(const struct gnp_any_plan *plan, const float *parameters, const struct gnp_any_end *end,
                               struct gnp_error *error)
{
	struct notes notes;
	write_notes(plan, end, &notes);
	const struct gnp_model_source source = {.architecture = plan->run.train.architecture, .regime = "any",
	                                        .more = notes.list, .more_count = notes.count, .parameters = parameters};
	return gnp_model_save(plan->output, &source, error);
}
