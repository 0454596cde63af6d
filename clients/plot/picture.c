#include "clients/plot/picture.h"

#include <ctype.h>
#include <png.h>
#include <stdlib.h>
#include <string.h>

#include "clients/plot/font.h"
#include "core/base/memory.h"

gnp_status gnp_picture_create(size_t width, size_t height, struct gnp_picture *picture, struct gnp_error *error)
{
	struct gnp_color *rgb = NULL;
	size_t pixels;
	if (gnp_size_multiply(width, height, &pixels))
		rgb = gnp_array_new(pixels, sizeof *rgb);
	if (!rgb)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "picture: no memory for %zux%zu pixels", width, height);
	memset(rgb, 255, pixels * sizeof *rgb);
	*picture = (struct gnp_picture){width, height, rgb};
	return GNP_OK;
}

void gnp_picture_clear(struct gnp_picture *picture)
{
	free(picture->rgb);
	*picture = (struct gnp_picture){0};
}

void gnp_picture_fill(struct gnp_picture *picture, long x, long y, long width, long height, struct gnp_color color)
{
	for (long row = y < 0 ? 0 : y; row < y + height && row < (long)picture->height; row++)
		for (long column = x < 0 ? 0 : x; column < x + width && column < (long)picture->width; column++)
			picture->rgb[(size_t)row * picture->width + (size_t)column] = color;
}

static void draw_glyph(struct gnp_picture *picture, long x, long y, int scale, struct gnp_color color, const char *dots)
{
	for (int row = 0; row < GNP_GLYPH_HEIGHT; row++)
		for (int column = 0; column < GNP_GLYPH_ADVANCE - 1; column++)
			if (dots[row * (GNP_GLYPH_ADVANCE - 1) + column] == '#')
				gnp_picture_fill(picture, x + column * scale, y + row * scale, scale, scale, color);
}

void gnp_picture_text(struct gnp_picture *picture, long x, long y, int scale, struct gnp_color color, const char *text)
{
	for (; *text; text++, x += GNP_GLYPH_ADVANCE * scale) {
		const char *dots = gnp_font_glyph((char)tolower((unsigned char)*text));
		if (dots)
			draw_glyph(picture, x, y, scale, color, dots);
	}
}

gnp_status gnp_picture_encode(const struct gnp_picture *picture, struct gnp_buffer *png, struct gnp_error *error)
{
	png_image image = {.version = PNG_IMAGE_VERSION, .width = (png_uint_32)picture->width,
	                   .height = (png_uint_32)picture->height, .format = PNG_FORMAT_RGB};
	png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
	gnp_status status = gnp_buffer_reserve(png, size, error);
	if (status != GNP_OK)
		return status;
	if (!png_image_write_to_memory(&image, png->data + png->size, &size, 0, picture->rgb, 0, NULL))
		return gnp_error_set(error, GNP_INTERNAL, "png: %s", image.message);
	png->size += size;
	return GNP_OK;
}
