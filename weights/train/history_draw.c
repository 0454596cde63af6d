/* Draws the picture of a training's history. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "clients/file_io.h"
#include "clients/plot/picture.h"
#include "weights/train/history.h"

enum { WIDTH = 960, HEIGHT = 600, LEFT = 80, RIGHT = 24, TOP = 48, BOTTOM = 48, SCALE = 2 };

static const struct gnp_color ink = {40, 40, 40}, pale = {225, 225, 225};

static double value_of(const struct gnp_history *history, const struct gnp_history_curve *curve, size_t row)
{
	return history->values[row * history->columns->count + curve->column];
}

/* The plane of the curves: steps from 0, and powers of ten. */
struct axes {
	double last;      /* step */
	double low, high; /* log10 */
};

static struct axes axes_of(const struct gnp_history *history, const struct gnp_history_curve *curves, size_t count)
{
	struct axes axes = {1, INFINITY, -INFINITY};
	for (size_t i = 0; i < history->count; i++) {
		axes.last = fmax(axes.last, (double)history->steps[i]);
		for (size_t c = 0; c < count; c++) {
			double value = log10(value_of(history, &curves[c], i));
			if (isfinite(value)) {
				axes.low = fmin(axes.low, value);
				axes.high = fmax(axes.high, value);
			}
		}
	}
	axes.low = isfinite(axes.low) ? floor(axes.low) : -1;
	axes.high = fmax(isfinite(axes.high) ? ceil(axes.high) : 0, axes.low + 1);
	return axes;
}

static double across(const struct axes *axes, double step)
{
	return LEFT + (WIDTH - LEFT - RIGHT) * step / axes->last;
}

static double down(const struct axes *axes, double value)
{
	return TOP + (HEIGHT - TOP - BOTTOM) * (axes->high - log10(value)) / (axes->high - axes->low);
}

static void draw_line(struct gnp_picture *picture, double x0, double y0, double x1, double y1, struct gnp_color color)
{
	int dots = (int)fmax(fabs(x1 - x0), fabs(y1 - y0)) + 1;
	for (int i = 0; i <= dots; i++) {
		double t = (double)i / dots;
		gnp_picture_fill(picture, lround(x0 + t * (x1 - x0)), lround(y0 + t * (y1 - y0)), SCALE, SCALE, color);
	}
}

static void draw_axes(struct gnp_picture *picture, const struct axes *axes, const char *title)
{
	char text[32];
	for (double power = axes->low; power <= axes->high; power++)
		for (int digit = 1; digit < 10; digit += digit == 1 ? 1 : 3) { /* 1, 2, 5, 8 */
			long y = lround(down(axes, digit * pow(10, power)));
			if (y < TOP || digit == 8)
				continue;
			gnp_picture_fill(picture, LEFT, y, WIDTH - LEFT - RIGHT, 1, pale);
			snprintf(text, sizeof text, "%g", digit * pow(10, power));
			gnp_picture_text(picture, 8, y - GNP_GLYPH_HEIGHT / 2, 1, ink, text);
		}
	for (int i = 0; i <= 4; i++) {
		double step = axes->last * i / 4;
		snprintf(text, sizeof text, "%.0f", step);
		gnp_picture_text(picture, lround(across(axes, step)) - (i == 4 ? 40 : 4), HEIGHT - BOTTOM + 10, 1, ink, text);
		gnp_picture_fill(picture, lround(across(axes, step)), TOP, 1, HEIGHT - TOP - BOTTOM, pale);
	}
	gnp_picture_text(picture, LEFT, HEIGHT - 20, 1, ink, "steps");
	gnp_picture_text(picture, LEFT, 8, SCALE, ink, title);
}

static void draw_curve(struct gnp_picture *picture, const struct axes *axes, const struct gnp_history *history,
                       const struct gnp_history_curve *curve)
{
	double x0 = NAN, y0 = NAN;
	for (size_t i = 0; i < history->count; i++) {
		double value = value_of(history, curve, i);
		if (!(value > 0) || isinf(value))
			continue;
		double x = across(axes, (double)history->steps[i]), y = down(axes, value);
		draw_line(picture, isnan(x0) ? x : x0, isnan(y0) ? y : y0, x, y, curve->color);
		x0 = x;
		y0 = y;
	}
}

gnp_status gnp_history_draw(const struct gnp_history *history, const struct gnp_history_curve *curves, size_t count,
                            const char *title, const char *path, struct gnp_error *error)
{
	struct gnp_picture picture;
	struct gnp_buffer png = {0};
	struct axes axes = axes_of(history, curves, count);
	gnp_status status = gnp_picture_create(WIDTH, HEIGHT, &picture, error);
	if (status != GNP_OK)
		return status;
	draw_axes(&picture, &axes, title);
	for (size_t c = 0; c < count; c++) {
		draw_curve(&picture, &axes, history, &curves[c]);
		gnp_picture_text(&picture, LEFT + 130 * (long)c, TOP - 18, SCALE, curves[c].color, curves[c].name);
	}
	status = gnp_picture_encode(&picture, &png, error);
	if (status == GNP_OK)
		status = gnp_file_write(path, png.data, png.size, error);
	gnp_buffer_clear(&png);
	gnp_picture_clear(&picture);
	return status;
}
