#include "weights/train/train_model.h"

#include <stdio.h>
#include <string.h>

#include "core/model/model.h"
#include "weights/train/loss_rule.h"

enum { NOTES = 16, NOTE_BYTES = 256 };

/* What people want to know of a training. */
struct notes {
	size_t count;
	char text[NOTES][NOTE_BYTES];
	struct gnp_safetensors_metadata list[NOTES];
};

/* Room for the text of one more. */
static char *add_note(struct notes *notes, const char *key)
{
	char *text = notes->text[notes->count];
	notes->list[notes->count++] = (struct gnp_safetensors_metadata){key, text};
	return text;
}

/* Rules that ask for nothing are not worth a word. */
static void note_rule(struct notes *notes, const char *key, const struct gnp_loss_rule *rule)
{
	if (gnp_loss_rule_asks(rule))
		gnp_loss_rule_print(rule, add_note(notes, key), NOTE_BYTES);
}

static void note_watched(struct notes *notes, const struct gnp_train_row *last)
{
	char *text = add_note(notes, "training_watched");
	size_t used = 0;
	for (int s = 0; s < GNP_SCORES && used < NOTE_BYTES; s++)
		used += (size_t)snprintf(text + used, NOTE_BYTES - used, "%s%s %.3g", s ? ", " : "", gnp_score_heading((enum gnp_score)s),
		                         last->watched[s]);
}

static void note_steps(struct notes *notes, const struct gnp_train_options *train)
{
	if (train->orthogonal)
		snprintf(add_note(notes, "training_step"), NOTE_BYTES, "muon for matrices, adam for vectors");
	if (train->average > 1)
		snprintf(add_note(notes, "training_average"), NOTE_BYTES, "of the last %llu steps",
		         (unsigned long long)train->average);
	if (train->only)
		snprintf(add_note(notes, "training_only"), NOTE_BYTES, "%s", train->only);
}

static void write_notes(const struct gnp_train_plan *plan, const struct gnp_train_row *last, struct notes *notes)
{
	const struct gnp_train_options *train = &plan->run.train;
	const struct gnp_train_data *data = &train->data;
	notes->count = 0;
	snprintf(add_note(notes, "training_seed"), NOTE_BYTES, "%llu", (unsigned long long)data->seed);
	snprintf(add_note(notes, "training_steps"), NOTE_BYTES, "%llu", (unsigned long long)last->step);
	snprintf(add_note(notes, "training_patches"), NOTE_BYTES, "%llu", (unsigned long long)(last->step * train->batch));
	snprintf(add_note(notes, "training_seconds"), NOTE_BYTES, "%.0f", last->seconds);
	snprintf(add_note(notes, "training_shapes"), NOTE_BYTES, "%zu radial, seeds 0..%zu, %zu points each", data->shapes, data->shapes - 1,
	         data->points);
	if (data->least_noise > 0)
		snprintf(add_note(notes, "training_noise"), NOTE_BYTES, "of every other shape %g to %g", data->least_noise, data->most_noise);
	snprintf(add_note(notes, "training_rate"), NOTE_BYTES, "%g to %g, batches of %zu", train->rate, train->rate * train->last,
	         train->batch);
	note_steps(notes, train);
	if (plan->from)
		snprintf(add_note(notes, "training_begun_from"), NOTE_BYTES, "%s", plan->from);
	note_rule(notes, "training_patch", &train->loss.patch);
	note_rule(notes, "training_centre", &train->loss.centre);
	note_rule(notes, "training_cell", &train->loss.cell);
	note_rule(notes, "training_near", &train->loss.near);
	if (plan->run.watch_shapes)
		note_watched(notes, last);
}

gnp_status gnp_train_model_write(const struct gnp_train_plan *plan, const float *parameters,
                                 const struct gnp_train_row *last, struct gnp_error *error)
{
	struct notes notes;
	char regime[16];
	const struct gnp_train_recipe *recipe = &plan->run.train.recipe;
	const char *name = gnp_regime_info(plan->run.train.data.regime)->name;
	snprintf(regime, sizeof regime, "%.*s", (int)strcspn(name, "-"), name);
	struct gnp_model_source source = {
		.architecture = plan->architecture,
		.recipe = {.k = (unsigned)recipe->k, .buffer = recipe->buffer, .height_scale = 2, .delta0_ratio = recipe->delta0_ratio},
		.regime = regime, .more = notes.list, .parameters = parameters};
	write_notes(plan, last, &notes);
	source.more_count = notes.count;
	return gnp_model_save(plan->output, &source, error);
}
