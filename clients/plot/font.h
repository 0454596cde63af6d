/* A 5x7 dot font: digits, lower-case letters and what numbers need. */
#ifndef GNP_CLIENTS_FONT_H
#define GNP_CLIENTS_FONT_H

/* 35 characters, 7 rows of 5 from the top, '#' where a dot is; NULL for a character the font lacks. */
const char *gnp_font_glyph(char character);

#endif
