#include <unistd.h>

#include "core/base/random.h"
#include "core/base/vector.h"
#include "core/support/weighted_projection.h"
#include "tests/unit/test.h"
#include "weights/train/initial.h"
#include "weights/validate/validation.h"

enum { POINTS = 3000, RESOLVING = 20000, CENTRES = 50 }; /* fewer resolve hardly a toroidal member */

static struct gnp_pool *pool; /* of two workers, for every test */
static char folder[64];       /* of the weights */
/* any, the regimes' with the pooled head, and with the projection head fit_noise_70k alone. */
static struct gnp_models *models;

static struct gnp_subject subject_of(enum gnp_family family, struct gnp_draws *draws)
{
	const struct gnp_protocol protocol = {.points = family == GNP_FAMILY_TOROIDAL ? RESOLVING : POINTS, .shapes = 8,
	                                      .centres = CENTRES};
	struct gnp_subject subject;
	struct gnp_error error = {0};
	draws->family = family;
	if (gnp_subject_draw(&protocol, draws, pool, &subject, &error) != GNP_OK) {
		fprintf(stderr, "%s\n", error.text);
		exit(1);
	}
	return subject;
}

/* ---- Scores: an estimate made of the truth, in frames tilted away from the normal ---- */

struct answer {
	double normals[3 * CENTRES], frame[9 * CENTRES], inverse[4 * CENTRES], form[4 * CENTRES], gaussian[CENTRES], mean[CENTRES];
};

static void normalize(double *a)
{
	double length = sqrt(gnp_dot(a, a));
	for (int c = 0; c < 3; c++)
		a[c] /= length;
}

/* psi3 within some thirty degrees of the normal, psi1 and psi2 anywhere round it. */
static void tilted_frame(const double *normal, struct gnp_random *random, double *frame)
{
	double other[3];
	for (int c = 0; c < 3; c++) {
		frame[6 + c] = normal[c] + 0.3 * gnp_random_normal(random);
		other[c] = gnp_random_normal(random);
	}
	normalize(frame + 6);
	gnp_cross(other, frame + 6, frame);
	normalize(frame);
	gnp_cross(frame + 6, frame, frame + 3);
}

/* The tensors by another way than the judge's: in-plane vectors lifted to the tangent plane along psi3, the metric from their
 * products, its inverse by cofactors. */
static void exact_tensors(const double *frame, const double *normal, const double *ambient, double *inverse, double *form)
{
	double lifted[2][3], g[3];
	for (int i = 0; i < 2; i++) {
		double along = gnp_dot(frame + 3 * i, normal) / gnp_dot(frame + 6, normal);
		for (int c = 0; c < 3; c++)
			lifted[i][c] = frame[3 * i + c] - along * frame[6 + c];
		CHECK_NEAR(gnp_dot(lifted[i], normal), 0, 1e-12);
	}
	g[0] = gnp_dot(lifted[0], lifted[0]);
	g[1] = gnp_dot(lifted[0], lifted[1]);
	g[2] = gnp_dot(lifted[1], lifted[1]);
	double determinant = g[0] * g[2] - g[1] * g[1];
	inverse[0] = g[2] / determinant;
	inverse[1] = inverse[2] = -g[1] / determinant;
	inverse[3] = g[0] / determinant;
	for (int i = 0; i < 4; i++) {
		form[i] = 0;
		for (int a = 0; a < 3; a++)
			for (int b = 0; b < 3; b++)
				form[i] += lifted[i / 2][a] * ambient[3 * a + b] * lifted[i % 2][b];
	}
}

static struct gnp_estimate estimate_of(struct answer *answer)
{
	struct gnp_estimate estimate = {.count = CENTRES};
	estimate.values[GNP_NORMALS] = answer->normals;
	estimate.values[GNP_FRAME] = answer->frame;
	estimate.values[GNP_INVERSE_METRIC] = answer->inverse;
	estimate.values[GNP_SECOND_FUNDAMENTAL_FORM] = answer->form;
	estimate.values[GNP_GAUSSIAN_CURVATURE] = answer->gaussian;
	estimate.values[GNP_MEAN_CURVATURE] = answer->mean;
	return estimate;
}

static void answer_exactly(const struct gnp_subject *subject, struct answer *answer)
{
	const struct gnp_sample *sample = &subject->sample;
	struct gnp_random random;
	gnp_random_seed(&random, 1, 0);
	for (size_t i = 0; i < CENTRES; i++) {
		size_t point = subject->centres[i];
		const double *normal = sample->normals + 3 * point;
		memcpy(answer->normals + 3 * i, normal, 3 * sizeof *normal);
		tilted_frame(normal, &random, answer->frame + 9 * i);
		exact_tensors(answer->frame + 9 * i, normal, sample->second_form + 9 * point, answer->inverse + 4 * i,
		              answer->form + 4 * i);
		answer->gaussian[i] = sample->gaussian_curvature[point];
		answer->mean[i] = sample->mean_curvature[point];
	}
}

static void the_truth_has_no_error(void)
{
	for (int family = 0; family < GNP_FAMILIES; family++) {
		struct gnp_draws draws = {0};
		struct gnp_subject subject = subject_of((enum gnp_family)family, &draws);
		struct answer answer;
		double errors[GNP_SCORES];
		CHECK(gnp_subject_enter(&subject, GNP_REGIME_NOISE_70, NULL) == GNP_OK);
		answer_exactly(&subject, &answer);
		struct gnp_estimate estimate = estimate_of(&answer);
		gnp_score_estimate(&subject.sample, subject.centres, &estimate, errors);
		for (int s = 0; s < GNP_SCORES; s++)
			CHECK_AT_MOST(errors[s], 1e-12);
		gnp_subject_clear(&subject);
	}
}

static void scale(double *values, size_t count, double factor)
{
	for (size_t i = 0; i < count; i++)
		values[i] *= factor;
}

/* Normals turned by an angle err by 1 - cos; tensors and scalars scaled by 1 + e err by e. */
static void known_perturbations_give_known_errors(void)
{
	struct gnp_draws draws = {0};
	struct gnp_subject subject = subject_of(GNP_FAMILY_RADIAL, &draws);
	struct answer answer;
	double errors[GNP_SCORES], angle = 1e-3;
	CHECK(gnp_subject_enter(&subject, GNP_REGIME_CLEAN_30, NULL) == GNP_OK);
	answer_exactly(&subject, &answer);
	scale(answer.inverse, 4 * CENTRES, 1.01);
	scale(answer.form, 4 * CENTRES, 0.98);
	scale(answer.gaussian, CENTRES, 1.03);
	scale(answer.mean, CENTRES, 0.96);
	for (size_t i = 0; i < CENTRES; i++) {
		double *normal = answer.normals + 3 * i, axis[3], side[3];
		gnp_cross(normal, answer.frame + 9 * i, axis);
		normalize(axis);
		gnp_cross(axis, normal, side);
		for (int c = 0; c < 3; c++)
			normal[c] = cos(angle) * normal[c] + sin(angle) * side[c];
	}
	struct gnp_estimate estimate = estimate_of(&answer);
	gnp_score_estimate(&subject.sample, subject.centres, &estimate, errors);
	CHECK_NEAR(errors[GNP_SCORE_NORMAL], 5e-7, 1e-12);
	CHECK_NEAR(errors[GNP_SCORE_INVERSE_METRIC], 0.01, 1e-10);
	CHECK_NEAR(errors[GNP_SCORE_SECOND_FORM], 0.02, 1e-10);
	CHECK_NEAR(errors[GNP_SCORE_GAUSSIAN], 0.03, 1e-10);
	CHECK_NEAR(errors[GNP_SCORE_MEAN], 0.04, 1e-10);
	answer.gaussian[7] = NAN;
	gnp_score_estimate(&subject.sample, subject.centres, &estimate, errors);
	CHECK(isnan(errors[GNP_SCORE_GAUSSIAN]) && !isnan(errors[GNP_SCORE_MEAN]));
	gnp_subject_clear(&subject);
}

/* ---- Protocol ---- */

static void seeds_of_training_and_validation_never_meet(void)
{
	static const uint64_t edges[] = {0, 1, GNP_SEED_WATCH - 1, GNP_SEED_WATCH, GNP_SEED_VALIDATION - 1, GNP_SEED_VALIDATION, 2 * GNP_SEED_VALIDATION - 1,
	                                 2 * GNP_SEED_VALIDATION, UINT64_MAX};
	for (size_t i = 0; i < sizeof edges / sizeof *edges; i++)
		CHECK(gnp_seed_is_validation(edges[i]) + gnp_seed_is_watch(edges[i]) +
		      (gnp_seed_check_training(edges[i], NULL) == GNP_OK) == (edges[i] < 2 * GNP_SEED_VALIDATION));
	CHECK(gnp_seed_check_training(0, NULL) == GNP_OK && gnp_seed_check_training(GNP_SEED_WATCH - 1, NULL) == GNP_OK);
	struct gnp_error error = {0};
	CHECK(gnp_seed_check_training(GNP_SEED_WATCH, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "training seed: got 2251799813685248, need less than 2251799813685248 (those that judge begin there)");
	for (int family = 0; family < GNP_FAMILIES; family++) {
		struct gnp_draws draws = {0};
		for (int i = 0; i < 2; i++) {
			struct gnp_subject subject = subject_of((enum gnp_family)family, &draws);
			CHECK(gnp_seed_is_validation(subject.seed));
			gnp_subject_clear(&subject);
		}
	}
}

static void radial_members_go_through_the_degrees(void)
{
	static const unsigned degrees[] = {3, 6, 8, 10, 12, 15, 18, 22, 3};
	struct gnp_draws draws = {0};
	for (size_t i = 0; i < sizeof degrees / sizeof *degrees; i++) {
		struct gnp_subject subject = subject_of(GNP_FAMILY_RADIAL, &draws);
		CHECK(subject.degree == degrees[i]);
		gnp_subject_clear(&subject);
	}
	CHECK(draws.drawn == 9 && draws.accepted == 9);
}

static void unresolved_members_are_skipped(void)
{
	struct gnp_draws draws = {0};
	for (int i = 0; i < 3; i++) {
		struct gnp_subject subject = subject_of(GNP_FAMILY_TOROIDAL, &draws);
		double largest = 0, epsilon = 1.1 * sqrt(30 * 8.8 / (M_PI * RESOLVING)); /* areas are about 8.8 */
		for (size_t p = 0; p < 2 * subject.sample.count; p++)
			largest = fmax(largest, fabs(subject.sample.principal_curvatures[p]));
		CHECK_AT_MOST(subject.sharpness, 1);
		CHECK_NEAR(subject.sharpness / (largest * epsilon), 1, 0.15);
		gnp_subject_clear(&subject);
	}
	CHECK(draws.accepted == 3 && draws.drawn > 3);
}

static void points_that_resolve_nothing_are_refused(void)
{
	const struct gnp_protocol protocol = {.points = 300, .shapes = 1, .centres = 10};
	struct gnp_draws draws = {.family = GNP_FAMILY_TOROIDAL};
	struct gnp_subject subject;
	struct gnp_error error = {0};
	CHECK(gnp_subject_draw(&protocol, &draws, pool, &subject, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "points: got 300, too few to resolve 40 toroidal draws in a row");
}

static void centres_are_distinct_and_no_outliers(void)
{
	struct gnp_draws draws = {0};
	struct gnp_subject subject = subject_of(GNP_FAMILY_RADIAL, &draws);
	for (int regime = 0; regime < GNP_REGIMES; regime++) {
		bool seen[POINTS] = {false};
		size_t outliers = 0, moved = 0;
		CHECK(gnp_subject_enter(&subject, (enum gnp_regime)regime, NULL) == GNP_OK);
		for (size_t i = 0; i < POINTS; i++) {
			outliers += subject.sample.outlier[i];
			moved += memcmp(subject.sample.points + 3 * i, subject.sample.exact + 3 * i, 3 * sizeof(double)) != 0;
		}
		for (size_t i = 0; i < CENTRES; i++) {
			uint32_t centre = subject.centres[i];
			CHECK(centre < POINTS && !seen[centre] && !subject.sample.outlier[centre]);
			seen[centre] = true;
		}
		CHECK(outliers == (regime == GNP_REGIME_OUTLIER_50 ? POINTS / 10 : 0));
		CHECK(moved == (regime == GNP_REGIME_NOISE_70 ? POINTS : outliers));
	}
	gnp_subject_clear(&subject);
}

static void too_many_centres_are_refused(void)
{
	const struct gnp_protocol protocol = {.points = 1000, .shapes = 1, .centres = 1000};
	struct gnp_draws draws = {.family = GNP_FAMILY_RADIAL};
	struct gnp_subject subject;
	struct gnp_error error = {0};
	CHECK(gnp_subject_draw(&protocol, &draws, pool, &subject, NULL) == GNP_OK);
	CHECK(gnp_subject_enter(&subject, GNP_REGIME_CLEAN_30, NULL) == GNP_OK);
	CHECK(gnp_subject_enter(&subject, GNP_REGIME_OUTLIER_50, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "centres: got 1000, the cloud has 900 points that are no outliers");
	gnp_subject_clear(&subject);
}

/* ---- Table ---- */

/* Of a selection, without what lacks its weights. */
static struct gnp_table table_of(size_t shapes, struct gnp_selection selection)
{
	const struct gnp_protocol protocol = {.points = POINTS, .shapes = shapes, .centres = CENTRES};
	struct gnp_table table = {0};
	gnp_selection_restrict(&selection, models);
	CHECK(gnp_table_create(&protocol, &selection, models, &table, NULL) == GNP_OK);
	return table;
}

static void rows_without_their_weights_are_left_out_or_refused(void)
{
	const struct gnp_protocol protocol = {.points = POINTS, .shapes = 1, .centres = CENTRES};
	struct gnp_selection selection = gnp_selection_all();
	struct gnp_table table = {0};
	struct gnp_error error = {0};
	CHECK(gnp_selection_count(&selection) == GNP_ROWS);
	CHECK(gnp_table_create(&protocol, &selection, models, &table, &error) == GNP_INVALID_ARGUMENT && !table.errors);
	CHECK_STRING(error.text, "fit in clean-30: weights: got \"fit_clean_30k\", known: any, clean_30k_pooled, clean_50k_pooled, "
	                         "fit_noise_70k, noise_70k_pooled, outlier_50k_pooled");
	gnp_selection_restrict(&selection, models);
	CHECK(gnp_selection_count(&selection) == GNP_ROWS - 3 * GNP_FAMILIES);
	CHECK(gnp_table_create(&protocol, &selection, models, &table, NULL) == GNP_OK);
	for (int number = 0; number < GNP_ROWS; number++) {
		const struct gnp_row row = {(enum gnp_family)(number / GNP_METHODS / GNP_REGIMES),
		                            (enum gnp_regime)(number / GNP_METHODS % GNP_REGIMES),
		                            (enum gnp_method)(number % GNP_METHODS)};
		CHECK(gnp_row_number(&row) == (size_t)number);
		CHECK(gnp_selection_has(&selection, &row) == (row.method != GNP_METHOD_FIT || row.regime == GNP_REGIME_NOISE_70));
	}
	gnp_table_clear(&table);
	struct gnp_error none = {0};
	gnp_selection_take(&selection, 1u << GNP_METHOD_GNP);
	CHECK(gnp_table_create(&protocol, &selection, NULL, &table, &none) == GNP_INVALID_ARGUMENT && !table.errors);
	CHECK_STRING(none.text, "gnp in clean-30: none of the 0 models is for any cloud (head weighted)");
	selection = gnp_selection_all();
	gnp_selection_restrict(&selection, NULL);
	CHECK(gnp_selection_count(&selection) == (size_t)2 * GNP_FAMILIES * GNP_REGIMES); /* gmls and adaptive need none */
}

static void learned_rows_take_their_models_k(void)
{
	struct gnp_table table = table_of(1, gnp_selection_all());
	const struct gnp_row gnp = {GNP_FAMILY_RADIAL, GNP_REGIME_NOISE_70, GNP_METHOD_GNP};
	const struct gnp_row fit = {GNP_FAMILY_TOROIDAL, GNP_REGIME_NOISE_70, GNP_METHOD_FIT};
	const struct gnp_row pooled = {GNP_FAMILY_RADIAL, GNP_REGIME_CLEAN_30, GNP_METHOD_POOLED};
	const struct gnp_row gmls = {GNP_FAMILY_RADIAL, GNP_REGIME_NOISE_70, GNP_METHOD_GMLS};
	CHECK_STRING(gnp_table_model(&table, &gnp)->name, "any");
	CHECK(gnp_table_k(&table, &gnp) == 70); /* the regime's: any goes by none */
	CHECK_STRING(gnp_table_model(&table, &fit)->name, "fit_noise_70k");
	CHECK_STRING(gnp_table_model(&table, &pooled)->name, "clean_30k_pooled");
	CHECK(gnp_table_k(&table, &fit) == 41 && gnp_table_k(&table, &pooled) == 42); /* of the models; the regimes say 70 and 30 */
	CHECK(!gnp_table_model(&table, &gmls) && gnp_table_k(&table, &gmls) == 70);
	gnp_table_clear(&table);
}

static void means_and_medians_are_over_shapes(void)
{
	static const double values[] = {5, 1, 100, 2};
	const struct gnp_row row = {GNP_FAMILY_TOROIDAL, GNP_REGIME_CLEAN_50, GNP_METHOD_GMLS};
	for (size_t shapes = 3; shapes <= 4; shapes++) {
		struct gnp_table table = table_of(shapes, gnp_selection_all());
		for (size_t i = 0; i < shapes; i++)
			gnp_table_errors(&table, &row, i)[GNP_SCORE_MEAN] = values[i];
		CHECK_NEAR(gnp_table_mean(&table, &row, GNP_SCORE_MEAN), shapes == 3 ? 106.0 / 3 : 27, 1e-12);
		CHECK_NEAR(gnp_table_median(&table, &row, GNP_SCORE_MEAN), shapes == 3 ? 5 : 3.5, 1e-12);
		gnp_table_errors(&table, &row, 1)[GNP_SCORE_MEAN] = NAN;
		CHECK(isnan(gnp_table_mean(&table, &row, GNP_SCORE_MEAN)) && isnan(gnp_table_median(&table, &row, GNP_SCORE_MEAN)));
		CHECK(!gnp_table_beats(&table, &row, GNP_SCORE_MEAN));
		gnp_table_clear(&table);
	}
}

static void a_cell_wins_below_both_printed_rows_only(void)
{
	struct gnp_table table = table_of(1, gnp_selection_all());
	const struct gnp_row clean = {GNP_FAMILY_RADIAL, GNP_REGIME_CLEAN_30, GNP_METHOD_GMLS};
	const struct gnp_row odd = {GNP_FAMILY_TOROIDAL, GNP_REGIME_CLEAN_50, GNP_METHOD_GMLS};
	double *errors = gnp_table_errors(&table, &clean, 0), target;
	errors[GNP_SCORE_GAUSSIAN] = 1.93e-2; /* the paper: gnp 4.07e-2, gmls 1.92e-2 */
	CHECK(!gnp_table_beats(&table, &clean, GNP_SCORE_GAUSSIAN));
	errors[GNP_SCORE_GAUSSIAN] = 1.91e-2;
	CHECK(gnp_table_beats(&table, &clean, GNP_SCORE_GAUSSIAN));
	CHECK(!gnp_table_beats(&table, &odd, GNP_SCORE_NORMAL) && !gnp_table_beats(&table, &odd, GNP_SCORE_INVERSE_METRIC));
	int judged = 0;
	for (int cell = 0; cell < GNP_FAMILIES * GNP_REGIMES * GNP_SCORES; cell++)
		judged += gnp_published_target((enum gnp_family)(cell / GNP_SCORES / GNP_REGIMES),
		                               (enum gnp_regime)(cell / GNP_SCORES % GNP_REGIMES), (enum gnp_score)(cell % GNP_SCORES),
		                               &target);
	CHECK(judged == GNP_FAMILIES * GNP_REGIMES * GNP_SCORES - 2);
	gnp_table_clear(&table);
}

/* Below one row of the paper, below both, above: counted by cell, beside either. */
static void verdicts_count_cells(void)
{
	struct gnp_table table = table_of(1, gnp_selection_all());
	struct gnp_row row;
	for (bool more = gnp_selection_next(&table.selection, NULL, &row); more; more = gnp_selection_next(&table.selection, &row, &row))
		for (int s = 0; s < GNP_SCORES; s++) {
			double gnp = gnp_published_error(row.family, row.regime, GNP_PUBLISHED_GNP, (enum gnp_score)s);
			double gmls = gnp_published_error(row.family, row.regime, GNP_PUBLISHED_GMLS, (enum gnp_score)s);
			double *error = gnp_table_errors(&table, &row, 0) + s;
			switch (row.method) {
			case GNP_METHOD_FIT: *error = gnp * 1.01; break;
			case GNP_METHOD_POOLED: *error = gnp * 0.99; break;
			case GNP_METHOD_GMLS: *error = fmin(gnp, gmls) * 0.99; break;
			default: *error = NAN;
			}
		}
	static const struct gnp_verdict want[GNP_METHODS] = {
		[GNP_METHOD_GNP] = {40, 0, 38, 0},
		[GNP_METHOD_FIT] = {10, 0, 10, 0},      /* one regime of two families */
		[GNP_METHOD_POOLED] = {40, 40, 38, 20}, /* the paper's GNP is the better of its rows under outliers and noise */
		[GNP_METHOD_GMLS] = {40, 40, 38, 38},
		[GNP_METHOD_ADAPTIVE] = {40, 0, 38, 0},
	};
	for (int c = 0; c < GNP_METHODS; c++) {
		const struct gnp_verdict got = gnp_table_verdict(&table, (enum gnp_method)c);
		CHECK(got.cells == want[c].cells && got.below_gnp == want[c].below_gnp);
		CHECK(got.judged == want[c].judged && got.below_both == want[c].below_both);
	}
	gnp_table_clear(&table);
}

static char *written(const struct gnp_table *table, void (*write)(const struct gnp_table *table, FILE *out))
{
	char *text = NULL;
	size_t size;
	FILE *out = open_memstream(&text, &size);
	write(table, out);
	fclose(out);
	return text;
}

/* Where both have weights: in one regime. */
static void gnp_is_compared_with_fit(void)
{
	struct gnp_table table = table_of(1, gnp_selection_all());
	struct gnp_row row;
	for (int f = 0; f < GNP_FAMILIES; f++)
		for (int s = 0; s < GNP_SCORES; s++) {
			const struct gnp_row gnp = {(enum gnp_family)f, GNP_REGIME_NOISE_70, GNP_METHOD_GNP};
			const struct gnp_row fit = {(enum gnp_family)f, GNP_REGIME_NOISE_70, GNP_METHOD_FIT};
			gnp_table_errors(&table, &gnp, 0)[s] = s == GNP_SCORE_MEAN ? 6 : 5.5 + f; /* over 4: 1.5, 1.375, 1.625 */
			gnp_table_errors(&table, &fit, 0)[s] = 4;
		}
	for (int f = 0; f < GNP_FAMILIES; f++)
		CHECK(gnp_table_next_ratio(&table, GNP_METHOD_FIT, f ? &row : NULL, &row) && row.family == (enum gnp_family)f &&
		      row.regime == GNP_REGIME_NOISE_70 && row.method == GNP_METHOD_GNP);
	CHECK(!gnp_table_next_ratio(&table, GNP_METHOD_FIT, &row, &row));
	char *text = written(&table, gnp_table_write_text);
	CHECK_CONTAINS(text, "gnp over fit");
	CHECK_CONTAINS(text, "1.62!");
	CHECK_CONTAINS(text, "At most 1.5 (else !): 6 of 10.");
	free(text);
	gnp_table_clear(&table);
}

static void gnp_is_compared_with_adaptive_off_clean_clouds(void)
{
	struct gnp_table table = table_of(1, gnp_selection_all());
	struct gnp_row row;
	for (int f = 0; f < 2 * GNP_FAMILIES; f++) {
		enum gnp_regime regime = f % 2 ? GNP_REGIME_NOISE_70 : GNP_REGIME_OUTLIER_50;
		const struct gnp_row gnp = {(enum gnp_family)(f / 2), regime, GNP_METHOD_GNP};
		const struct gnp_row adaptive = {(enum gnp_family)(f / 2), regime, GNP_METHOD_ADAPTIVE};
		gnp_table_errors(&table, &gnp, 0)[GNP_SCORE_MEAN] = 3;
		gnp_table_errors(&table, &adaptive, 0)[GNP_SCORE_MEAN] = 4 + f;
		CHECK(gnp_table_next_ratio(&table, GNP_METHOD_ADAPTIVE, f ? &row : NULL, &row) && row.family == gnp.family);
		CHECK(row.regime == regime && row.method == GNP_METHOD_GNP);
		CHECK_NEAR(gnp_table_ratio(&table, &row, GNP_METHOD_ADAPTIVE, GNP_SCORE_MEAN), 3.0 / (4 + f), 1e-15);
	}
	CHECK(!gnp_table_next_ratio(&table, GNP_METHOD_ADAPTIVE, &row, &row));
	gnp_table_clear(&table);
	struct gnp_selection alone = gnp_selection_all();
	gnp_selection_take(&alone, 1u << GNP_METHOD_GNP);
	table = table_of(1, alone);
	CHECK(!gnp_table_next_ratio(&table, GNP_METHOD_ADAPTIVE, NULL, &row));
	gnp_table_clear(&table);
}

/* Distinct values in every cell, so that each can be found in what is written. */
static void fill(struct gnp_table *table)
{
	struct gnp_row row;
	double value = 1;
	for (bool more = gnp_selection_next(&table->selection, NULL, &row); more;
	     more = gnp_selection_next(&table->selection, &row, &row))
		for (int s = 0; s < GNP_SCORES; s++, value++)
			for (size_t i = 0; i < table->protocol.shapes; i++)
				gnp_table_errors(table, &row, i)[s] = 1 + value / 100;
}

static void every_cell_is_printed(void)
{
	struct gnp_table table = table_of(2, gnp_selection_all());
	char *texts[3], cell[32];
	fill(&table);
	texts[0] = written(&table, gnp_table_write_text);
	texts[1] = written(&table, gnp_table_write_markdown);
	texts[2] = written(&table, gnp_table_write_json);
	int cells = (int)gnp_selection_count(&table.selection) * GNP_SCORES;
	for (int i = 0; i < 3; i++) {
		for (int value = 1; value <= cells; value++) {
			snprintf(cell, sizeof cell, i == 2 ? "%.6e" : "%.2e", 1 + value / 100.0);
			CHECK_CONTAINS(texts[i], cell);
		}
		CHECK_CONTAINS(texts[i], "4503599627370496");
		for (size_t m = 0; m < gnp_models_count(models); m++) {
			CHECK_CONTAINS(texts[i], gnp_models_at(models, m)->name);
			CHECK_CONTAINS(texts[i], gnp_models_at(models, m)->sha256);
		}
	}
	for (int i = 0; i < 2; i++) {
		CHECK_CONTAINS(texts[i], "3.97e-10?");
		CHECK_CONTAINS(texts[i], "3.61e-03?");
		CHECK_CONTAINS(texts[i], "6.93e-01 ");
		CHECK_CONTAINS(texts[i], "largest |principal curvature| times epsilon is at most 1");
		CHECK_CONTAINS(texts[i], "gmls: 0 of 40 cells below the paper's GNP row, 0 of 38 judged cells below both of its rows.");
		CHECK_CONTAINS(texts[i], "gnp over adaptive");
	}
	CHECK_CONTAINS(texts[2], "\"paper_gnp\": {\"normal\": 2.040000e-06");
	CHECK_CONTAINS(texts[2], "\"below_both\": {\"normal\": null, \"inverse_metric\": null, \"second_fundamental_form\": false");
	for (int i = 0; i < 3; i++)
		free(texts[i]);
	gnp_table_clear(&table);
}

/* A run in small: every selected cell gets a value, the same for any worker count, and nothing else does. */
static void a_run_fills_its_selection_alike_for_any_worker_count(void)
{
	struct gnp_selection selection = {.families = 1u << GNP_FAMILY_RADIAL,
	                                  .regimes = 1u << GNP_REGIME_CLEAN_30 | 1u << GNP_REGIME_NOISE_70};
	gnp_selection_take(&selection, 1u << GNP_METHOD_GNP | 1u << GNP_METHOD_FIT | 1u << GNP_METHOD_POOLED |
	                                   1u << GNP_METHOD_GMLS);
	struct gnp_table one = table_of(2, selection), two = table_of(2, selection);
	struct gnp_pool *single = NULL;
	struct gnp_task task;
	gnp_task_init(&task);
	CHECK(gnp_pool_create(1, &single, NULL) == GNP_OK);
	CHECK(gnp_validation_run(&one, single, &task, NULL) == GNP_OK);
	CHECK(gnp_validation_run(&two, pool, NULL, NULL) == GNP_OK);
	struct gnp_selection all = gnp_selection_all();
	struct gnp_row row;
	for (bool more = gnp_selection_next(&all, NULL, &row); more; more = gnp_selection_next(&all, &row, &row))
		for (size_t i = 0; i < 2; i++) {
			const double *a = gnp_table_errors(&one, &row, i), *b = gnp_table_errors(&two, &row, i);
			bool selected = gnp_selection_has(&one.selection, &row);
			bool untrained = row.method == GNP_METHOD_POOLED || row.method == GNP_METHOD_GNP;
			CHECK(memcmp(a, b, GNP_SCORES * sizeof *a) == 0);
			for (int s = 0; s < GNP_SCORES; s++)
				CHECK(selected ? a[s] > 0 && (a[s] < 1 || untrained) : a[s] == 0);
		}
	CHECK(gnp_selection_count(&one.selection) == 7); /* fit has no weights for clean-30 */
	CHECK(one.drawn[GNP_FAMILY_RADIAL] == 2 && one.drawn[GNP_FAMILY_TOROIDAL] == 0);
	CHECK(gnp_table_shape(&one, GNP_FAMILY_RADIAL, 1)->degree == 12); /* the second of two, evenly spaced */
	gnp_task_cancel(&task);
	CHECK(gnp_validation_run(&one, single, &task, NULL) == GNP_CANCELLED);
	gnp_pool_free(single);
	gnp_table_clear(&one);
	gnp_table_clear(&two);
}

/* ---- Weights: untrained, but the projection head starts as plain least squares ---- */

static const char *const FILES[] = {"any", "clean_30k_pooled", "clean_50k_pooled",
                                    "fit_noise_70k", "noise_70k_pooled", "outlier_50k_pooled"};
enum { FILES_COUNT = sizeof FILES / sizeof FILES[0] };

static void weights_path(int i, char path[128])
{
	snprintf(path, 128, "%s/%s.safetensors", folder, FILES[i]);
}

static gnp_status write_weights(int i, struct gnp_error *error)
{
	struct gnp_model_source source = {
		.architecture = {.trunk = GNP_TRUNK_SEPARABLE, .head = GNP_HEAD_POOLED, .features = 3, .width = 8, .channels = 2, .neurons = 5,
		                 .layers = 1, .quadrature = 4, .head_width = 6, .outputs = 16},
		.recipe = {.k = 42, .buffer = 1.25, .height_scale = 2, .delta0_ratio = 0.13}, .regime = "clean"};
	struct gnp_layout layout;
	char path[128];
	if (i == 0) {
		source.architecture.head = GNP_HEAD_WEIGHTED;
		source.architecture.features = GNP_SUPPORT_FEATURES;
		source.architecture.quadrature = GNP_QUADRATURE_MAX;
		source.architecture.node_width = source.architecture.frame_width = 8;
		source.architecture.outputs = GNP_WEIGHTED_OUTPUTS;
		source.recipe = (struct gnp_recipe){0};
		source.regime = "any";
	} else if (!strstr(FILES[i], "pooled")) {
		source.architecture.head = GNP_HEAD_PROJECTION;
		source.architecture.features = 4;
		source.architecture.shells = 2;
		source.architecture.shell[0] = 60;
		source.architecture.shell[1] = 90;
		source.architecture.ridge = 1e-9;
		source.architecture.outputs = (unsigned)gnp_projection_outputs(&source.architecture);
		source.recipe.k = 41;
	}
	gnp_status status = gnp_architecture_layout(&source.architecture, &layout, error);
	if (status != GNP_OK)
		return status;
	float *parameters = malloc(layout.total * sizeof *parameters);
	gnp_initial_parameters(&source.architecture, &layout, 1, parameters);
	source.parameters = parameters;
	weights_path(i, path);
	status = gnp_model_save(path, &source, error);
	free(parameters);
	return status;
}

static bool make_models(struct gnp_error *error)
{
	snprintf(folder, sizeof folder, "/tmp/gnp-test-XXXXXX");
	bool made = mkdtemp(folder);
	for (int i = 0; i < FILES_COUNT && made; i++)
		made = write_weights(i, error) == GNP_OK;
	return made && gnp_models_load(folder, &models, error) == GNP_OK;
}

static void remove_models(void)
{
	char path[128];
	gnp_models_release(models);
	for (int i = 0; i < FILES_COUNT; i++) {
		weights_path(i, path);
		unlink(path);
	}
	rmdir(folder);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(the_truth_has_no_error),
		TEST(known_perturbations_give_known_errors),
		TEST(seeds_of_training_and_validation_never_meet),
		TEST(radial_members_go_through_the_degrees),
		TEST(unresolved_members_are_skipped),
		TEST(points_that_resolve_nothing_are_refused),
		TEST(centres_are_distinct_and_no_outliers),
		TEST(too_many_centres_are_refused),
		TEST(rows_without_their_weights_are_left_out_or_refused),
		TEST(learned_rows_take_their_models_k),
		TEST(means_and_medians_are_over_shapes),
		TEST(a_cell_wins_below_both_printed_rows_only),
		TEST(verdicts_count_cells),
		TEST(gnp_is_compared_with_fit),
		TEST(gnp_is_compared_with_adaptive_off_clean_clouds),
		TEST(every_cell_is_printed),
		TEST(a_run_fills_its_selection_alike_for_any_worker_count),
	};
	struct gnp_error error = {0};
	if (!make_models(&error) || gnp_pool_create(2, &pool, &error) != GNP_OK) {
		fprintf(stderr, "%s\n", error.text);
		return 1;
	}
	int failed = RUN_TESTS(tests);
	gnp_pool_free(pool);
	remove_models();
	return failed;
}
