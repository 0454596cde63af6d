#include "proto/tensor/datatype.h"

#include <string.h>

static const struct {
	const char *name;
	size_t size;
} datatypes[] = {
#define ROW(id, name, bytes) {name, bytes},
	GNP_DATATYPE_TABLE(ROW)
#undef ROW
};

const char *gnp_datatype_name(enum gnp_datatype datatype)
{
	return datatype < GNP_DATATYPE_COUNT ? datatypes[datatype].name : "unknown";
}

size_t gnp_datatype_size(enum gnp_datatype datatype)
{
	return datatype < GNP_DATATYPE_COUNT ? datatypes[datatype].size : 0;
}

bool gnp_datatype_find(const char *name, enum gnp_datatype *datatype)
{
	for (int i = 0; i < GNP_DATATYPE_COUNT; i++) {
		if (strcmp(name, datatypes[i].name) == 0) {
			*datatype = (enum gnp_datatype)i;
			return true;
		}
	}
	return false;
}
