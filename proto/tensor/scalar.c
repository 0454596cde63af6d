#include "proto/tensor/scalar.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

static double half_to_double(uint16_t bits)
{
	int exponent = bits >> 10 & 31, fraction = bits & 1023;
	double value;
	if (exponent == 31)
		value = fraction ? NAN : INFINITY;
	else if (exponent)
		value = ldexp(1024 + fraction, exponent - 25);
	else
		value = ldexp(fraction, -24);
	return bits >> 15 ? -value : value;
}

#define LOAD(type)                           \
	do {                                     \
		type item;                           \
		memcpy(&item, source, sizeof item);  \
		return (double)item;                 \
	} while (0)

double gnp_scalar_load(enum gnp_datatype datatype, const void *source)
{
	uint16_t half;
	switch (datatype) {
	case GNP_BOOL: return *(const unsigned char *)source != 0;
	case GNP_UINT8: LOAD(uint8_t);
	case GNP_UINT16: LOAD(uint16_t);
	case GNP_UINT32: LOAD(uint32_t);
	case GNP_UINT64: LOAD(uint64_t);
	case GNP_INT8: LOAD(int8_t);
	case GNP_INT16: LOAD(int16_t);
	case GNP_INT32: LOAD(int32_t);
	case GNP_INT64: LOAD(int64_t);
	case GNP_FP16:
		memcpy(&half, source, sizeof half);
		return half_to_double(half);
	case GNP_FP32: LOAD(float);
	case GNP_FP64: LOAD(double);
	default: return 0;
	}
}

/* Both bounds are exact doubles and exclusive: the truncated value then lies within the type. */
#define STORE(type, below, above)               \
	do {                                        \
		if (!(value > (below) && value < (above))) \
			return false;                       \
		type item = (type)value;                \
		memcpy(target, &item, sizeof item);     \
		return true;                            \
	} while (0)

static bool store_float(void *target, double value)
{
	float item = (float)value;
	if (isinf(item) && !isinf(value))
		return false;
	memcpy(target, &item, sizeof item);
	return true;
}

bool gnp_scalar_store(enum gnp_datatype datatype, void *target, double value)
{
	switch (datatype) {
	case GNP_BOOL:
		if (value != 0 && value != 1)
			return false;
		*(unsigned char *)target = value != 0;
		return true;
	case GNP_UINT8: STORE(uint8_t, -1.0, 256.0);
	case GNP_UINT16: STORE(uint16_t, -1.0, 65536.0);
	case GNP_UINT32: STORE(uint32_t, -1.0, 4294967296.0);
	case GNP_UINT64: STORE(uint64_t, -1.0, 18446744073709551616.0);
	case GNP_INT8: STORE(int8_t, -129.0, 128.0);
	case GNP_INT16: STORE(int16_t, -32769.0, 32768.0);
	case GNP_INT32: STORE(int32_t, -2147483649.0, 2147483648.0);
	case GNP_INT64: STORE(int64_t, -9223372036854777856.0, 9223372036854775808.0);
	case GNP_FP32: return store_float(target, value);
	case GNP_FP64:
		memcpy(target, &value, sizeof value);
		return true;
	default: return false;
	}
}

void gnp_scalar_swap(void *target, const void *source, size_t count, size_t size)
{
	unsigned char *to = target;
	const unsigned char *from = source;
	for (size_t i = 0; i < count; i++, to += size, from += size) {
		for (size_t b = 0; b < size; b++)
			to[b] = from[size - 1 - b];
	}
}

enum gnp_datatype gnp_scalar_floating(enum gnp_datatype datatype)
{
	switch (datatype) {
	case GNP_UINT32:
	case GNP_UINT64:
	case GNP_INT32:
	case GNP_INT64:
	case GNP_FP64: return GNP_FP64;
	default: return GNP_FP32;
	}
}
