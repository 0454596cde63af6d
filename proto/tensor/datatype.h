/* The types of a tensor's elements, by the names the Open Inference Protocol gives them. */
#ifndef GNP_PROTO_DATATYPE_H
#define GNP_PROTO_DATATYPE_H

#include <stdbool.h>
#include <stddef.h>

/* enumerator, Open Inference Protocol name, bytes an element (0: variable) */
#define GNP_DATATYPE_TABLE(X)                                                                                  \
	X(GNP_BOOL, "BOOL", 1) X(GNP_UINT8, "UINT8", 1) X(GNP_UINT16, "UINT16", 2) X(GNP_UINT32, "UINT32", 4)      \
	X(GNP_UINT64, "UINT64", 8) X(GNP_INT8, "INT8", 1) X(GNP_INT16, "INT16", 2) X(GNP_INT32, "INT32", 4)        \
	X(GNP_INT64, "INT64", 8) X(GNP_FP16, "FP16", 2) X(GNP_FP32, "FP32", 4) X(GNP_FP64, "FP64", 8)              \
	X(GNP_BYTES, "BYTES", 0)

enum gnp_datatype {
#define GNP_DATATYPE_ENUM(id, name, bytes) id,
	GNP_DATATYPE_TABLE(GNP_DATATYPE_ENUM)
#undef GNP_DATATYPE_ENUM
	GNP_DATATYPE_COUNT
};

/* "unknown", and 0, for what is no datatype. */
const char *gnp_datatype_name(enum gnp_datatype datatype);
size_t gnp_datatype_size(enum gnp_datatype datatype);
/* By the name above; false, and *datatype unchanged, when there is none. */
bool gnp_datatype_find(const char *name, enum gnp_datatype *datatype);

#endif
