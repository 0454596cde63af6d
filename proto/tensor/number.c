#include "proto/tensor/number.h"

#include <locale.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* value = mantissa * 10^exponent, exactly unless truncated: digits past the 19th were not all zero. */
struct decimal {
	uint64_t mantissa;
	long exponent;
	bool negative, truncated;
};

enum { DIGITS_MAX = 19, EXPONENT_LIMIT = 1000000, TOKEN_MAX = 1200 };

static bool is_digit(char c)
{
	return (unsigned)(c - '0') < 10;
}

/* Consumes digits; fraction: each one kept lowers the exponent, else each one dropped raises it. */
static const char *scan_digits(const char *p, const char *end, bool fraction, unsigned *kept, struct decimal *d)
{
	for (; p < end && is_digit(*p); p++) {
		if (*kept < DIGITS_MAX) {
			d->mantissa = 10 * d->mantissa + (unsigned)(*p - '0');
			*kept += d->mantissa != 0;
			d->exponent -= fraction;
		} else {
			d->truncated |= *p != '0';
			d->exponent += !fraction;
		}
	}
	return p;
}

/* An exponent part, or nothing when there is none that is complete. */
static const char *scan_exponent(const char *p, const char *end, struct decimal *d)
{
	if (p == end || (*p != 'e' && *p != 'E'))
		return p;
	const char *q = p + 1;
	bool negative = q < end && *q == '-';
	q += q < end && (*q == '-' || *q == '+');
	if (q == end || !is_digit(*q))
		return p;
	long exponent = 0;
	for (; q < end && is_digit(*q); q++) {
		if (exponent < EXPONENT_LIMIT)
			exponent = 10 * exponent + (*q - '0');
	}
	d->exponent += negative ? -exponent : exponent;
	return q;
}

static const char *scan(const char *p, const char *end, struct decimal *d)
{
	unsigned kept = 0;
	*d = (struct decimal){0};
	if (p < end && (*p == '-' || *p == '+'))
		d->negative = *p++ == '-';
	const char *digits = p;
	p = scan_digits(p, end, false, &kept, d);
	size_t count = (size_t)(p - digits);
	if (p < end && *p == '.') {
		const char *fraction = ++p;
		p = scan_digits(p, end, true, &kept, d);
		count += (size_t)(p - fraction);
	}
	return count ? scan_exponent(p, end, d) : NULL;
}

static const uint64_t powers_of_five[] = {
	UINT64_C(1), UINT64_C(5), UINT64_C(25), UINT64_C(125), UINT64_C(625), UINT64_C(3125), UINT64_C(15625),
	UINT64_C(78125), UINT64_C(390625), UINT64_C(1953125), UINT64_C(9765625), UINT64_C(48828125), UINT64_C(244140625),
	UINT64_C(1220703125), UINT64_C(6103515625), UINT64_C(30517578125), UINT64_C(152587890625),
	UINT64_C(762939453125), UINT64_C(3814697265625), UINT64_C(19073486328125), UINT64_C(95367431640625),
	UINT64_C(476837158203125), UINT64_C(2384185791015625), UINT64_C(11920928955078125),
	UINT64_C(59604644775390625), UINT64_C(298023223876953125), UINT64_C(1490116119384765625),
	UINT64_C(7450580596923828125)
};
enum { FIVE_MAX = sizeof powers_of_five / sizeof powers_of_five[0] - 1 };

/* mantissa * 10^exponent for |exponent| <= FIVE_MAX in 128-bit integers. The quotient or product keeps at least 62 bits
 * and a sticky one for the rest, so that the one rounding, to 53 bits, is right. */
static double exact(uint64_t mantissa, int exponent)
{
	int shift = __builtin_clzll(mantissa);
	uint64_t top = mantissa << shift, rest;
	int binary = exponent - shift;
	if (exponent < 0) {
		uint64_t five = powers_of_five[-exponent];
		int five_shift = __builtin_clzll(five);
		unsigned __int128 numerator = (unsigned __int128)top << 63;
		five <<= five_shift;
		top = (uint64_t)(numerator / five);
		rest = (uint64_t)(numerator % five);
		binary += five_shift - 63;
	} else {
		unsigned __int128 product = (unsigned __int128)top * powers_of_five[exponent];
		int high = product >> 64 ? 64 - __builtin_clzll((uint64_t)(product >> 64)) : 0;
		top = (uint64_t)(product >> high);
		rest = (product & (((unsigned __int128)1 << high) - 1)) != 0;
		binary += high;
	}
	return ldexp((double)(top | (rest != 0)), binary);
}

/* Extreme exponents and long mantissas. The "C" locale object is static in the C library, nothing is allocated. */
static bool read_slowly(const char *text, size_t length, double *value)
{
	char token[TOKEN_MAX];
	if (length >= sizeof token)
		return false;
	memcpy(token, text, length);
	token[length] = '\0';
	locale_t c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
	if (!c_locale)
		return false;
	*value = strtod_l(token, NULL, c_locale);
	freelocale(c_locale);
	return true;
}

static bool decimal_value(const struct decimal *d, const char *text, size_t length, double *value)
{
	static const double powers_of_ten[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
	                                       1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
	double magnitude;
	if (d->mantissa == 0)
		magnitude = 0;
	else if (d->truncated || d->exponent > FIVE_MAX || d->exponent < -FIVE_MAX)
		return read_slowly(text, length, value);
	else if (d->mantissa <= UINT64_C(1) << 53 && d->exponent >= -22 && d->exponent <= 22)
		magnitude = d->exponent < 0 ? (double)d->mantissa / powers_of_ten[-d->exponent]
		                            : (double)d->mantissa * powers_of_ten[d->exponent];
	else
		magnitude = exact(d->mantissa, (int)d->exponent);
	*value = d->negative ? -magnitude : magnitude;
	return true;
}

/* nan, inf, infinity in any case. */
static const char *read_word(const char *text, const char *end, double *value)
{
	bool negative = text < end && *text == '-';
	const char *p = text + (text < end && (*text == '-' || *text == '+'));
	size_t left = (size_t)(end - p), length = 3;
	if (left >= 3 && strncasecmp(p, "nan", 3) == 0)
		*value = NAN;
	else if (left >= 3 && strncasecmp(p, "inf", 3) == 0)
		*value = negative ? -INFINITY : INFINITY;
	else
		return NULL;
	if (left >= 8 && strncasecmp(p, "infinity", 8) == 0)
		length = 8;
	return p + length;
}

const char *gnp_number_read(const char *text, const char *end, double *value)
{
	struct decimal d;
	const char *after = scan(text, end, &d);
	if (!after)
		return read_word(text, end, value);
	return decimal_value(&d, text, (size_t)(after - text), value) ? after : NULL;
}

const char *gnp_number_read_json(const char *text, const char *end, double *value)
{
	const char *p = text + (text < end && *text == '-');
	if (p == end || !is_digit(*p) || (*p == '0' && p + 1 < end && is_digit(p[1])))
		return NULL;
	struct decimal d;
	const char *after = scan(text, end, &d);
	if (!after || after[-1] == '.')
		return NULL;
	if (after < end && (*after == 'e' || *after == 'E'))
		return NULL;
	const char *point = memchr(text, '.', (size_t)(after - text));
	if (point && !is_digit(point[1]))
		return NULL;
	return decimal_value(&d, text, (size_t)(after - text), value) ? after : NULL;
}

/* x * 10^exponent with a relative error of a few 2^-64 where long double has 64 bits. */
static long double scale_decimal(long double x, int exponent)
{
	static const long double ones[] = {1e0L, 1e1L, 1e2L,  1e3L,  1e4L,  1e5L,  1e6L,  1e7L,
	                                   1e8L, 1e9L, 1e10L, 1e11L, 1e12L, 1e13L, 1e14L, 1e15L};
	static const long double sixteens[] = {1e0L,   1e16L,  1e32L,  1e48L,  1e64L,  1e80L,  1e96L,  1e112L,
	                                       1e128L, 1e144L, 1e160L, 1e176L, 1e192L, 1e208L, 1e224L, 1e240L,
	                                       1e256L, 1e272L, 1e288L, 1e304L, 1e320L, 1e336L};
	unsigned n = (unsigned)(exponent < 0 ? -exponent : exponent);
	long double power = ones[n % 16];
	if (n >= 16)
		power *= sixteens[n / 16];
	return exponent < 0 ? x / power : x * power;
}

/* The shortest decimal within `half` (half a unit in the last place) of x > 0, at most `digits` digits: returns its
 * mantissa, without trailing zeros, and *exponent. Half a percent of half is left to the scaling's rounding. */
static uint64_t shortest(long double x, long double half, int digits, int *exponent)
{
	int binary;
	frexpl(x, &binary);
	int power = digits - 1 - (int)floor((binary - 1) * 0.30102999566398120);
	long double scaled = scale_decimal(x, power), limit = scale_decimal(1, digits);
	if (scaled >= limit)
		scaled = scale_decimal(x, --power);
	half = 0.995L * scale_decimal(half, power);
	uint64_t best = (uint64_t)llrintl(scaled), unit = 1;
	for (uint64_t next = 10; next <= UINT64_C(100000000000000000); next *= 10) {
		uint64_t candidate = (best + next / 2) / next * next;
		if (candidate == 0 || fabsl((long double)candidate - scaled) >= half)
			break;
		best = candidate;
		unit = next;
	}
	best /= unit;
	*exponent = -power;
	for (; unit > 1; unit /= 10)
		++*exponent;
	while (best % 10 == 0) {
		best /= 10;
		++*exponent;
	}
	return best;
}

/* digits[0].digits[1...]e(point - 1) */
static size_t write_scientific(char *text, const char *digits, size_t count, int point)
{
	char *p = text;
	int exponent = point - 1;
	*p++ = digits[0];
	if (count > 1) {
		*p++ = '.';
		memcpy(p, digits + 1, count - 1);
		p += count - 1;
	}
	*p++ = 'e';
	*p++ = exponent < 0 ? '-' : '+';
	exponent = abs(exponent);
	if (exponent >= 100)
		*p++ = (char)('0' + exponent / 100);
	*p++ = (char)('0' + exponent / 10 % 10);
	*p++ = (char)('0' + exponent % 10);
	return (size_t)(p - text);
}

/* The decimal point stands after digit number `point`, -4 <= point <= 16. */
static size_t write_plain(char *text, const char *digits, size_t count, int point)
{
	size_t whole = point > 0 ? (size_t)point : 0;
	char *p = text;
	if (whole == 0) {
		memcpy(p, "0.0000", 6);
		p += 2 - point;
	} else if (whole >= count) {
		memcpy(p, digits, count);
		memset(p + count, '0', whole - count);
		return whole;
	} else {
		memcpy(p, digits, whole);
		p += whole;
		*p++ = '.';
	}
	memcpy(p, digits + whole, count - whole);
	return (size_t)(p - text) + count - whole;
}

static size_t write_decimal(char *text, uint64_t mantissa, int exponent)
{
	char buffer[20], *digits = buffer + sizeof buffer;
	for (; mantissa; mantissa /= 10)
		*--digits = (char)('0' + mantissa % 10);
	size_t count = (size_t)(buffer + sizeof buffer - digits);
	int point = (int)count + exponent;
	return point < -4 || point > 16 ? write_scientific(text, digits, count, point) : write_plain(text, digits, count, point);
}

static size_t write_special(char *text, double value)
{
	const char *word = isnan(value) ? "nan" : value > 0 ? "inf" : value < 0 ? "-inf" : signbit(value) ? "-0" : "0";
	size_t length = strlen(word);
	memcpy(text, word, length);
	return length;
}

/* precision: bits of the mantissa; lowest: exponent of the smallest subnormal. */
static size_t write_number(char *text, double value, int precision, int lowest, int digits)
{
	if (!isfinite(value) || value == 0)
		return write_special(text, value);
	size_t sign = value < 0;
	if (sign)
		*text++ = '-';
	int binary, exponent;
	double magnitude = fabs(value), fraction = frexp(magnitude, &binary);
	int unit = binary - precision < lowest ? lowest : binary - precision;
	/* Below a power of two the spacing is half as wide. */
	long double half = ldexpl(fraction == 0.5 ? 0.25L : 0.5L, unit);
	uint64_t mantissa = shortest(magnitude, half, digits, &exponent);
	return sign + write_decimal(text, mantissa, exponent);
}

size_t gnp_number_write_float(char *text, float value)
{
	return write_number(text, value, 24, -149, 9);
}

size_t gnp_number_write_double(char *text, double value)
{
	return write_number(text, value, 53, -1074, 17);
}
