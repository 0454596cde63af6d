#include "core/fit/quantity.h"

#include <string.h>

static const struct gnp_quantity_info table[GNP_QUANTITY_COUNT] = {
#define GNP_QUANTITY_ROW(id, text, dimensions, rows, columns, product, sentence)                  \
	[id] = {.name = text, .help = sentence, .rank = dimensions, .width = product,                 \
	        .shape = {rows, columns, dimensions == 3 ? 2 : 1}},
	GNP_QUANTITY_TABLE(GNP_QUANTITY_ROW)
#undef GNP_QUANTITY_ROW
};

const struct gnp_quantity_info *gnp_quantity_info(enum gnp_quantity quantity)
{
	return (unsigned)quantity < GNP_QUANTITY_COUNT ? &table[quantity] : NULL;
}

bool gnp_quantity_find(const char *name, size_t length, enum gnp_quantity *quantity)
{
	for (int i = 0; i < GNP_QUANTITY_COUNT; i++)
		if (strlen(table[i].name) == length && memcmp(table[i].name, name, length) == 0) {
			*quantity = (enum gnp_quantity)i;
			return true;
		}
	return false;
}
