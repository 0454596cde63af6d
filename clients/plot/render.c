#include "clients/plot/render.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

enum { SUPERSAMPLE = 2 };

/* Rows: right, up, towards the viewer. */
struct camera {
	double axes[3][3];
	double center[3]; /* of the view, in camera axes */
	double scale;     /* fine pixels a unit of length */
	double left, top; /* fine pixel of the centre */
};

/* What is known of a fine pixel. */
struct fragment {
	float depth;         /* of the nearest disc, towards the viewer; -FLT_MAX: nothing here */
	float weight, value; /* sums over the discs blended */
	float normal[3];
};

struct canvas {
	size_t width, height;
	struct fragment *fragments; /* (height, width) */
};

/* A point in camera axes. */
struct surfel {
	double center[3], normal[3], radius, value; /* center in fine pixels, as is radius */
};

/* Margins in pixels of the picture. */
enum { MARGIN = 24, BAR_SPACE = 150 };

static void rotate(const struct camera *camera, const double *in, double out[3])
{
	for (int i = 0; i < 3; i++)
		out[i] = camera->axes[i][0] * in[0] + camera->axes[i][1] * in[1] + camera->axes[i][2] * in[2];
}

static void set_axes(struct camera *camera, const struct gnp_scene *scene)
{
	double az = scene->azimuth * M_PI / 180, el = scene->elevation * M_PI / 180;
	double axes[3][3] = {{-sin(az), cos(az), 0},
	                     {-sin(el) * cos(az), -sin(el) * sin(az), cos(el)},
	                     {cos(el) * cos(az), cos(el) * sin(az), sin(el)}};
	/* The axes are written for z up; another axis up is the same with the coordinates moved round. */
	int shift = (2 - scene->up + 3) % 3;
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			camera->axes[i][j] = axes[i][(j + shift) % 3];
}

/* Fits the cloud, discs included, into the picture beside the colour bar. */
static void fit(struct camera *camera, const struct gnp_scene *scene)
{
	double low[3] = {DBL_MAX, DBL_MAX, DBL_MAX}, high[3] = {-DBL_MAX, -DBL_MAX, -DBL_MAX};
	for (size_t i = 0; i < scene->count; i++) {
		double p[3];
		rotate(camera, scene->points + 3 * i, p);
		for (int j = 0; j < 3; j++) {
			low[j] = fmin(low[j], p[j] - scene->radii[i]);
			high[j] = fmax(high[j], p[j] + scene->radii[i]);
		}
	}
	double space_x = (double)scene->width - 2 * MARGIN - (scene->values ? BAR_SPACE : 0);
	double space_y = (double)scene->height - 2 * MARGIN;
	for (int j = 0; j < 3; j++)
		camera->center[j] = low[j] / 2 + high[j] / 2;
	double tightest = fmax((high[0] - low[0]) / fmax(space_x, 1), (high[1] - low[1]) / fmax(space_y, 1));
	camera->scale = SUPERSAMPLE / fmax(tightest, DBL_MIN);
	camera->left = SUPERSAMPLE * (MARGIN + space_x / 2);
	camera->top = SUPERSAMPLE * (MARGIN + space_y / 2);
}

static struct surfel project(const struct camera *camera, const struct gnp_scene *scene, size_t i)
{
	/* A disc thinner than a pixel would leave holes; a normal across the view would make it a needle. */
	const double radius_least = 0.9 * SUPERSAMPLE, facing_least = 0.2;
	struct surfel surfel = {.normal = {0, 0, 1}};
	double p[3];
	rotate(camera, scene->points + 3 * i, p);
	surfel.center[0] = camera->left + camera->scale * (p[0] - camera->center[0]);
	surfel.center[1] = camera->top - camera->scale * (p[1] - camera->center[1]);
	surfel.center[2] = camera->scale * (p[2] - camera->center[2]);
	surfel.radius = fmax(scene->radii[i] * camera->scale, radius_least);
	surfel.value = scene->values ? scene->values[i] : 0;
	if (!scene->normals)
		return surfel;
	double n[3];
	rotate(camera, scene->normals + 3 * i, n);
	double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
	double side = n[2] < 0 ? -1 : 1; /* both sides are lit alike */
	if (!(length > 0))
		return surfel;
	for (int j = 0; j < 3; j++)
		surfel.normal[j] = side * n[j] / length;
	surfel.normal[2] = fmax(surfel.normal[2], facing_least);
	return surfel;
}

/* Depth of the surfel's plane at an offset in the picture, and its share there: 1 in the middle, 0 outside. */
static double surfel_at(const struct surfel *surfel, double dx, double dy, double *depth)
{
	/* Rows run downwards, the camera's second axis upwards. */
	double dz = -(surfel->normal[0] * dx - surfel->normal[1] * dy) / surfel->normal[2];
	double squared = (dx * dx + dy * dy + dz * dz) / (surfel->radius * surfel->radius);
	*depth = surfel->center[2] + dz;
	return squared < 1 ? (1 - squared) * (1 - squared) : 0;
}

static void blend(struct fragment *fragment, const struct surfel *surfel, double depth, double share)
{
	if (depth < (double)fragment->depth - surfel->radius)
		return;
	float weight = (float)share;
	fragment->weight += weight;
	fragment->value += weight * (float)surfel->value;
	for (int j = 0; j < 3; j++)
		fragment->normal[j] += weight * (float)surfel->normal[j];
}

/* First pass: the nearest depth. Second pass: the mean of what lies there. */
enum pass { PASS_DEPTH, PASS_BLEND };

static void draw_surfel(struct canvas *canvas, const struct surfel *surfel, enum pass pass)
{
	double r = surfel->radius;
	long x0 = (long)fmax(0, ceil(surfel->center[0] - r - 0.5)), y0 = (long)fmax(0, ceil(surfel->center[1] - r - 0.5));
	long x1 = (long)fmin((double)canvas->width - 1, floor(surfel->center[0] + r - 0.5));
	long y1 = (long)fmin((double)canvas->height - 1, floor(surfel->center[1] + r - 0.5));
	for (long y = y0; y <= y1; y++) {
		for (long x = x0; x <= x1; x++) {
			double depth, share = surfel_at(surfel, (double)x + 0.5 - surfel->center[0], (double)y + 0.5 - surfel->center[1], &depth);
			struct fragment *fragment = &canvas->fragments[(size_t)y * canvas->width + (size_t)x];
			if (share <= 0)
				continue;
			if (pass == PASS_DEPTH)
				fragment->depth = fmaxf(fragment->depth, (float)depth);
			else
				blend(fragment, surfel, depth, share);
		}
	}
}

static void draw_cloud(struct canvas *canvas, const struct camera *camera, const struct gnp_scene *scene)
{
	for (int pass = PASS_DEPTH; pass <= PASS_BLEND; pass++) {
		for (size_t i = 0; i < scene->count; i++) {
			struct surfel surfel = project(camera, scene, i);
			if (pass == PASS_DEPTH || !isnan(surfel.value))
				draw_surfel(canvas, &surfel, (enum pass)pass);
		}
	}
}

/* Brightness and highlight for a unit normal: a key light over the viewer's left shoulder and a soft one from the front. */
static void light(const double n[3], double *diffuse, double *highlight)
{
	static const double key[3] = {-0.45, 0.60, 0.66}, half[3] = {-0.247, 0.329, 0.911};
	double k = fmax(0, n[0] * key[0] + n[1] * key[1] + n[2] * key[2]);
	double h = fmax(0, n[0] * half[0] + n[1] * half[1] + n[2] * half[2]);
	*diffuse = 0.32 + 0.36 * k + 0.27 * n[2];
	*highlight = 0.10 * pow(h, 40);
}

static void shade(const struct gnp_scene *scene, const struct fragment *fragment, double depth_low, double depth_high, double rgb[3])
{
	static const struct gnp_color plain = {205, 212, 222};
	double diffuse = 1, highlight = 0;
	double value = fragment->weight > 0 ? (double)(fragment->value / fragment->weight) : NAN;
	struct gnp_color color = scene->values ? gnp_colormap_color(&scene->range, value) : plain;
	if (scene->normals && fragment->weight > 0) {
		double n[3] = {fragment->normal[0], fragment->normal[1], fragment->normal[2]};
		double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
		for (int j = 0; j < 3; j++)
			n[j] /= length;
		light(n, &diffuse, &highlight);
	} else if (depth_high > depth_low) {
		diffuse = 0.45 + 0.55 * ((double)fragment->depth - depth_low) / (depth_high - depth_low);
	}
	const double base[3] = {color.r, color.g, color.b};
	for (int j = 0; j < 3; j++)
		rgb[j] = fmin(255, base[j] * diffuse + 255 * highlight);
}

static void depth_range(const struct canvas *canvas, double *low, double *high)
{
	*low = DBL_MAX;
	*high = -DBL_MAX;
	for (size_t i = 0; i < canvas->width * canvas->height; i++) {
		double depth = (double)canvas->fragments[i].depth;
		if (depth <= -FLT_MAX)
			continue;
		*low = fmin(*low, depth);
		*high = fmax(*high, depth);
	}
}

/* Fine pixels to pixels, white behind. */
static void resolve(const struct gnp_scene *scene, const struct canvas *canvas, struct gnp_picture *picture)
{
	double low, high;
	depth_range(canvas, &low, &high);
	for (size_t y = 0; y < picture->height; y++) {
		for (size_t x = 0; x < picture->width; x++) {
			double sum[3] = {0, 0, 0};
			for (size_t s = 0; s < SUPERSAMPLE * SUPERSAMPLE; s++) {
				size_t row = y * SUPERSAMPLE + s / SUPERSAMPLE, column = x * SUPERSAMPLE + s % SUPERSAMPLE;
				const struct fragment *fragment = &canvas->fragments[row * canvas->width + column];
				double rgb[3] = {255, 255, 255};
				if (fragment->depth > -FLT_MAX)
					shade(scene, fragment, low, high, rgb);
				for (int j = 0; j < 3; j++)
					sum[j] += rgb[j] / (SUPERSAMPLE * SUPERSAMPLE);
			}
			picture->rgb[y * picture->width + x] =
				(struct gnp_color){(unsigned char)(sum[0] + 0.5), (unsigned char)(sum[1] + 0.5), (unsigned char)(sum[2] + 0.5)};
		}
	}
}

static void draw_bar(const struct gnp_scene *scene, struct gnp_picture *picture)
{
	enum { BAR_WIDTH = 22, TICKS = 7, TEXT_SCALE = 2 };
	static const struct gnp_color ink = {40, 40, 40};
	long height = (long)picture->height * 6 / 10, top = ((long)picture->height - height) / 2;
	long left = (long)picture->width - BAR_SPACE + 10;
	gnp_picture_fill(picture, left - 1, top - 1, BAR_WIDTH + 2, height + 2, ink);
	for (long y = 0; y < height; y++) {
		double value = scene->range.high - (scene->range.high - scene->range.low) * ((double)y + 0.5) / (double)height;
		gnp_picture_fill(picture, left, top + y, BAR_WIDTH, 1, gnp_colormap_color(&scene->range, value));
	}
	double ticks[TICKS];
	size_t count = gnp_colormap_ticks(&scene->range, TICKS, ticks);
	for (size_t i = 0; i < count; i++) {
		char text[32];
		double share = (scene->range.high - ticks[i]) / (scene->range.high - scene->range.low);
		long y = top + (long)(share * (double)(height - 1) + 0.5);
		snprintf(text, sizeof text, "%.5g", ticks[i] + 0.0);
		gnp_picture_fill(picture, left + BAR_WIDTH + 1, y, 5, 1, ink);
		gnp_picture_text(picture, left + BAR_WIDTH + 10, y - TEXT_SCALE * GNP_GLYPH_HEIGHT / 2, TEXT_SCALE, ink, text);
	}
	if (scene->title) {
		long width = (long)strlen(scene->title) * GNP_GLYPH_ADVANCE * TEXT_SCALE;
		long x = (long)picture->width - 12 - width;
		gnp_picture_text(picture, x < left ? x : left, top - 30, TEXT_SCALE, ink, scene->title);
	}
}

gnp_status gnp_render(const struct gnp_scene *scene, struct gnp_picture *picture, struct gnp_error *error)
{
	struct camera camera;
	struct canvas canvas = {scene->width * SUPERSAMPLE, scene->height * SUPERSAMPLE, NULL};
	struct gnp_picture drawn;
	gnp_status status = gnp_picture_create(scene->width, scene->height, &drawn, error);
	if (status != GNP_OK)
		return status;
	canvas.fragments = gnp_array_zero(canvas.width * canvas.height, sizeof *canvas.fragments);
	if (!canvas.fragments) {
		gnp_picture_clear(&drawn);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "picture: no memory for %zux%zu pixels", scene->width, scene->height);
	}
	for (size_t i = 0; i < canvas.width * canvas.height; i++)
		canvas.fragments[i].depth = -FLT_MAX;
	set_axes(&camera, scene);
	fit(&camera, scene);
	draw_cloud(&canvas, &camera, scene);
	resolve(scene, &canvas, &drawn);
	if (scene->values)
		draw_bar(scene, &drawn);
	free(canvas.fragments);
	*picture = drawn;
	return GNP_OK;
}
