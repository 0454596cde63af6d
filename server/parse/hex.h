/* Hexadecimal digits as this program writes them. */
#ifndef GNPD_HEX_H
#define GNPD_HEX_H

/* 0..15 of one of 0-9, a-f; -1 of anything else. */
static inline int gnpd_hex_digit(char c)
{
	if (c >= '0' && c <= '9')
		return c - '0';
	return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

#endif
