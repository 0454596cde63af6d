/* An RGB picture: rectangles, small text, and its PNG form (the one libpng user). */
#ifndef GNP_CLIENTS_PICTURE_H
#define GNP_CLIENTS_PICTURE_H

#include <stddef.h>

#include "core/base/status.h"
#include "proto/tensor/message.h"

struct gnp_color {
	unsigned char r, g, b;
};

/* rgb: (height, width), rows from the top, freed by gnp_picture_clear. */
struct gnp_picture {
	size_t width, height;
	struct gnp_color *rgb;
};

/* Filled with white. On failure *picture is unchanged. */
gnp_status gnp_picture_create(size_t width, size_t height, struct gnp_picture *picture, struct gnp_error *error);
void gnp_picture_clear(struct gnp_picture *picture);

/* Parts outside the picture are left out. */
void gnp_picture_fill(struct gnp_picture *picture, long x, long y, long width, long height, struct gnp_color color);

/* Text from its upper left corner in a 5x7 font, each dot scale x scale pixels. Letters are drawn in lower case; a
 * character the font lacks is left blank. */
enum { GNP_GLYPH_ADVANCE = 6, GNP_GLYPH_HEIGHT = 7 };
void gnp_picture_text(struct gnp_picture *picture, long x, long y, int scale, struct gnp_color color, const char *text);

gnp_status gnp_picture_encode(const struct gnp_picture *picture, struct gnp_buffer *png, struct gnp_error *error);

#endif
