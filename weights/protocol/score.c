#include "weights/protocol/score.h"

#include <math.h>

#include "core/base/vector.h"

const char *gnp_score_name(enum gnp_score score)
{
	static const char *const names[GNP_SCORES] = {
#define GNP_SCORE_NAME(id, name, heading, quantity) name,
		GNP_SCORE_TABLE(GNP_SCORE_NAME)
#undef GNP_SCORE_NAME
	};
	return names[score];
}

const char *gnp_score_heading(enum gnp_score score)
{
	static const char *const headings[GNP_SCORES] = {
#define GNP_SCORE_HEADING(id, name, heading, quantity) heading,
		GNP_SCORE_TABLE(GNP_SCORE_HEADING)
#undef GNP_SCORE_HEADING
	};
	return headings[score];
}

uint64_t gnp_score_quantities(void)
{
	uint64_t mask = GNP_QUANTITY_BIT(GNP_FRAME);
#define GNP_SCORE_MASK(id, name, heading, quantity) mask |= GNP_QUANTITY_BIT(quantity);
	GNP_SCORE_TABLE(GNP_SCORE_MASK)
#undef GNP_SCORE_MASK
	return mask;
}

/* g^-1 of the graph with the slopes h, and its tangents in space. */
static void exact_first_order(const double frame[9], const double normal[3], double inverse[4], double tangents[2][3])
{
	const double *psi3 = frame + 6;
	double n3 = gnp_dot(psi3, normal), h[2] = {-gnp_dot(frame, normal) / n3, -gnp_dot(frame + 3, normal) / n3};
	double determinant = 1 + h[0] * h[0] + h[1] * h[1];
	inverse[0] = (1 + h[1] * h[1]) / determinant;
	inverse[1] = inverse[2] = -h[0] * h[1] / determinant;
	inverse[3] = (1 + h[0] * h[0]) / determinant;
	for (int i = 0; i < 2; i++)
		for (int c = 0; c < 3; c++)
			tangents[i][c] = frame[3 * i + c] + h[i] * psi3[c];
}

static void exact_second_form(const double ambient[9], double tangents[2][3], double form[4])
{
	for (int j = 0; j < 2; j++) {
		double image[3];
		for (int c = 0; c < 3; c++)
			image[c] = gnp_dot(ambient + 3 * c, tangents[j]);
		for (int i = 0; i < 2; i++)
			form[2 * i + j] = gnp_dot(tangents[i], image);
	}
}

/* Squares summed: of the difference and of the truth. */
struct sums {
	double error[GNP_SCORES], size[GNP_SCORES];
};

static void add(struct sums *sums, enum gnp_score score, const double *got, const double *want, int width)
{
	for (int i = 0; i < width; i++) {
		sums->error[score] += (got[i] - want[i]) * (got[i] - want[i]);
		sums->size[score] += want[i] * want[i];
	}
}

static void add_centre(struct sums *sums, const struct gnp_sample *sample, size_t point,
                       const struct gnp_estimate *estimate, size_t row)
{
	double *const *values = estimate->values;
	const double *normal = sample->normals + 3 * point;
	double inverse[4], form[4], tangents[2][3];
	exact_first_order(values[GNP_FRAME] + 9 * row, normal, inverse, tangents);
	exact_second_form(sample->second_form + 9 * point, tangents, form);
	add(sums, GNP_SCORE_INVERSE_METRIC, values[GNP_INVERSE_METRIC] + 4 * row, inverse, 4);
	add(sums, GNP_SCORE_SECOND_FORM, values[GNP_SECOND_FUNDAMENTAL_FORM] + 4 * row, form, 4);
	add(sums, GNP_SCORE_GAUSSIAN, values[GNP_GAUSSIAN_CURVATURE] + row, sample->gaussian_curvature + point, 1);
	add(sums, GNP_SCORE_MEAN, values[GNP_MEAN_CURVATURE] + row, sample->mean_curvature + point, 1);
}

/* 1 - n.n' of unit vectors as |n - n'|^2 / 2, which keeps its digits where they agree. */
static double normal_error(const double *got, const double *want)
{
	double sum = 0;
	for (int c = 0; c < 3; c++)
		sum += (got[c] - want[c]) * (got[c] - want[c]);
	return sum / 2;
}

void gnp_score_estimate(const struct gnp_sample *sample, const uint32_t *at, const struct gnp_estimate *estimate,
                        double errors[GNP_SCORES])
{
	struct sums sums = {{0}, {0}};
	double normals = 0;
	for (size_t row = 0; row < estimate->count; row++) {
		add_centre(&sums, sample, at[row], estimate, row);
		normals += normal_error(estimate->values[GNP_NORMALS] + 3 * row, sample->normals + 3 * (size_t)at[row]);
	}
	for (int s = 0; s < GNP_SCORES; s++)
		errors[s] = sqrt(sums.error[s] / sums.size[s]);
	errors[GNP_SCORE_NORMAL] = normals / (double)estimate->count;
}
