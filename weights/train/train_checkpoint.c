#include "weights/train/train_checkpoint.h"

#include <stdio.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "weights/train/array_file.h"

enum { VERSION = 2, PIECES = 7 };

gnp_status gnp_train_state_create(size_t parameters, struct gnp_train_state *out, struct gnp_error *error)
{
	struct gnp_train_state state = {.parameters = gnp_array_zero(parameters, sizeof *state.parameters),
	                                .average = gnp_array_zero(parameters, sizeof *state.average)};
	gnp_status status = GNP_OK;
	if (!state.parameters || !state.average)
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory for %zu parameters", parameters);
	if (status == GNP_OK)
		status = gnp_adam_create(parameters, &state.adam, error);
	if (status == GNP_OK)
		*out = state;
	else
		gnp_train_state_clear(&state);
	return status;
}

void gnp_train_state_clear(struct gnp_train_state *state)
{
	free(state->parameters);
	free(state->average);
	gnp_adam_clear(&state->adam);
	*state = (struct gnp_train_state){0};
}

static void describe(const char *what, struct gnp_train_state *state, char title[GNP_ARRAY_FILE_TITLE],
                     struct gnp_array_piece pieces[PIECES])
{
	size_t bytes = state->adam.count * sizeof(float);
	snprintf(title, GNP_ARRAY_FILE_TITLE, "gnp-train-checkpoint %d parameters %zu %s", VERSION, state->adam.count, what);
	pieces[0] = (struct gnp_array_piece){state->parameters, bytes};
	pieces[1] = (struct gnp_array_piece){state->adam.first, bytes};
	pieces[2] = (struct gnp_array_piece){state->adam.second, bytes};
	pieces[3] = (struct gnp_array_piece){state->average, bytes};
	pieces[4] = (struct gnp_array_piece){&state->adam.step, sizeof state->adam.step};
	pieces[5] = (struct gnp_array_piece){&state->step, sizeof state->step};
	pieces[6] = (struct gnp_array_piece){&state->seconds, sizeof state->seconds};
}

gnp_status gnp_train_state_save(const char *path, const char *what, const struct gnp_train_state *state, struct gnp_error *error)
{
	struct gnp_train_state copy = *state; /* pieces are not const */
	struct gnp_array_piece pieces[PIECES];
	char title[GNP_ARRAY_FILE_TITLE];
	describe(what, &copy, title, pieces);
	return gnp_array_file_write(path, title, pieces, PIECES, error);
}

gnp_status gnp_train_state_load(const char *path, const char *what, struct gnp_train_state *state, struct gnp_error *error)
{
	struct gnp_array_piece pieces[PIECES];
	char title[GNP_ARRAY_FILE_TITLE];
	describe(what, state, title, pieces);
	return gnp_array_file_read(path, title, pieces, PIECES, error);
}
