#include "core/linear/components.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

/* Tarjan's search with a stack of its own: clouds are deeper than thread stacks. */
struct search {
	const struct gnp_csr *matrix;
	const unsigned char *given;
	uint32_t *seen, *low;   /* (n) order of discovery from 1, 0 before it; the earliest one reached */
	uint32_t *set;          /* (n) number of the strongly connected set; GNP_COMPONENT_NONE while open */
	uint32_t *open, *path;  /* (n) unknowns not yet in a set; the way to the current one */
	size_t *next;           /* (n) next entry of each on the path */
	bool *leaves;           /* (n) by set: an edge leaves it */
	uint32_t time, sets;
	size_t open_count, path_count;
};

/* An unknown that is given mentions nobody. */
static size_t row_end(const struct search *search, uint32_t i)
{
	return search->given && search->given[i] ? search->matrix->row_offsets[i] : search->matrix->row_offsets[i + 1];
}

static void discover(struct search *search, uint32_t i)
{
	search->seen[i] = search->low[i] = ++search->time;
	search->next[i] = search->matrix->row_offsets[i];
	search->open[search->open_count++] = i;
	search->path[search->path_count++] = i;
}

static void close_set(struct search *search, uint32_t root)
{
	uint32_t i;
	bool leaves = search->given && search->given[root];
	size_t first = search->open_count;
	do
		search->set[search->open[--first]] = search->sets;
	while (search->open[first] != root);
	for (size_t o = first; o < search->open_count; o++) {
		i = search->open[o];
		for (size_t e = search->matrix->row_offsets[i]; e < row_end(search, i); e++)
			leaves |= search->set[search->matrix->column[e]] != search->sets;
	}
	search->open_count = first;
	search->leaves[search->sets++] = leaves;
}

static void advance(struct search *search)
{
	uint32_t i = search->path[search->path_count - 1];
	while (search->next[i] < row_end(search, i)) {
		uint32_t j = search->matrix->column[search->next[i]++];
		if (!search->seen[j]) {
			discover(search, j);
			return;
		}
		if (search->set[j] == GNP_COMPONENT_NONE && search->seen[j] < search->low[i])
			search->low[i] = search->seen[j];
	}
	if (search->low[i] == search->seen[i])
		close_set(search, i);
	if (--search->path_count > 0) {
		uint32_t before = search->path[search->path_count - 1];
		if (search->low[i] < search->low[before])
			search->low[before] = search->low[i];
	}
}

static void find_sets(struct search *search)
{
	for (uint32_t i = 0; i < search->matrix->rows; i++) {
		if (search->seen[i])
			continue;
		discover(search, i);
		while (search->path_count > 0)
			advance(search);
	}
}

/* Numbers the sets that stand alone as their first unknowns come. number (sets): spare. */
static void number_sets(const struct search *search, uint32_t *number, struct gnp_components *out)
{
	memset(number, 0xff, search->sets * sizeof *number);
	for (uint32_t i = 0; i < search->matrix->rows; i++) {
		uint32_t set = search->set[i];
		if (search->leaves[set]) {
			out->label[i] = GNP_COMPONENT_NONE;
			out->following++;
			continue;
		}
		if (number[set] == GNP_COMPONENT_NONE) {
			out->anchor[out->count] = i;
			out->size[out->count] = 0;
			number[set] = (uint32_t)out->count++;
		}
		out->label[i] = number[set];
		out->size[number[set]]++;
	}
}

void gnp_components_clear(struct gnp_components *components)
{
	free(components->label);
	free(components->anchor);
	free(components->size);
	*components = (struct gnp_components){.count = 0};
}

gnp_status gnp_components_find(const struct gnp_csr *matrix, const unsigned char *given, struct gnp_components *out,
                               struct gnp_error *error)
{
	size_t n = matrix->rows;
	struct gnp_components found = {.unknowns = n, .label = gnp_array_new(n, sizeof(uint32_t)),
	                               .anchor = gnp_array_new(n, sizeof(uint32_t)),
	                               .size = gnp_array_new(n, sizeof(size_t))};
	uint32_t *block = gnp_array_zero(n, 5 * sizeof *block);
	size_t *next = gnp_array_new(n, sizeof *next);
	bool *leaves = gnp_array_new(n, sizeof *leaves);
	bool room = found.label && found.anchor && found.size && block && next && leaves;
	if (room) {
		struct search search = {.matrix = matrix, .given = given, .seen = block, .low = block + n, .set = block + 2 * n,
		                        .open = block + 3 * n, .path = block + 4 * n, .next = next, .leaves = leaves};
		memset(search.set, 0xff, n * sizeof *search.set);
		find_sets(&search);
		number_sets(&search, search.open, &found);
		*out = found;
	} else {
		gnp_components_clear(&found);
	}
	free(block);
	free(next);
	free(leaves);
	return room ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY, "components: no memory for %zu unknowns", n);
}
