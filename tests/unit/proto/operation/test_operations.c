/* The table of operations: its tables are sound, and its defaults are those of the functions that set them. */
#include "tests/unit/test.h"

#include "core/equations/poisson.h"
#include "core/estimate/estimate.h"
#include "core/estimate/filter.h"
#include "core/flow/flow.h"
#include "proto/operation/operations.h"
#include "proto/operation/parameter.h"

static const struct gnp_operation *estimate(void)
{
	return gnp_operation_find("estimate");
}

static void check_parameter_error(const char *name, const char *text, const char *want)
{
	struct gnp_estimate_options options = gnp_estimate_defaults(), before = options;
	struct gnp_error error = {0};
	CHECK(gnp_parameter_parse(estimate(), &options, name, text, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, want);
	CHECK(memcmp(&options, &before, sizeof options) == 0);
}

static void parameter_errors_name_value_and_limit(void)
{
	check_parameter_error("k", "0", "k: got 0, need 12..500");
	check_parameter_error("k", "501", "k: got 501, need 12..500");
	check_parameter_error("k", "abc", "k: got \"abc\", need an integer");
	check_parameter_error("k", "30x", "k: got \"30x\", need an integer");
	check_parameter_error("k", "30.5", "k: got 30.5, need an integer");
	check_parameter_error("k", "nan", "k: got \"nan\", need an integer");
	check_parameter_error("k", "99999999999999999999", "need 12..500");
	check_parameter_error("k", "", "k: got \"\", need an integer");
	check_parameter_error("basis", "cubic", "basis: got \"cubic\", need one of tensor, total");
	check_parameter_error("quantities", "normals,color", "quantities: unknown \"color\", known: points, normals");
	check_parameter_error("quantities", "", "quantities: got none, need at least one of points");
	check_parameter_error("weights", "../clean", "weights: got \"../clean\", need auto or the name of a model");
	check_parameter_error("weights", "", "weights: got \"\", need auto or");
	check_parameter_error("kk", "30", "unknown parameter \"kk\", known: estimator, weights, cover, k, degree");
}

static void parameters_parse_from_text(void)
{
	struct gnp_estimate_options options = gnp_estimate_defaults();
	CHECK(gnp_parameter_parse(estimate(), &options, "k", "30.0", NULL) == GNP_OK && options.k == 30);
	CHECK(gnp_parameter_parse(estimate(), &options, "weight", "linear", NULL) == GNP_OK &&
	      options.weight == GNP_WEIGHT_LINEAR);
	CHECK(gnp_parameter_parse(estimate(), &options, "quantities", "normals,frame", NULL) == GNP_OK);
	CHECK(options.quantities == (GNP_QUANTITY_BIT(GNP_NORMALS) | GNP_QUANTITY_BIT(GNP_FRAME)));
	CHECK(gnp_parameter_parse(estimate(), &options, "quantities", "all", NULL) == GNP_OK);
	CHECK(options.quantities == GNP_QUANTITY_ALL);
}

static void default_texts_equal_the_defaults(void)
{
	for (size_t i = 0; gnp_operation_at(i); i++) {
		const struct gnp_operation *operation = gnp_operation_at(i);
		_Alignas(16) unsigned char options[GNP_OPTIONS_SIZE_MAX] = {0}, parsed[GNP_OPTIONS_SIZE_MAX] = {0};
		operation->defaults(options);
		operation->defaults(parsed);
		for (size_t p = 0; p < operation->parameter_count; p++) {
			const struct gnp_parameter *parameter = &operation->parameters[p];
			static const size_t sizes[] = {
				[GNP_PARAMETER_INTEGER] = sizeof(int), [GNP_PARAMETER_NUMBER] = sizeof(double),
				[GNP_PARAMETER_AUTO] = sizeof(double), [GNP_PARAMETER_BOOL] = sizeof(bool),
				[GNP_PARAMETER_CHOICE] = sizeof(int), [GNP_PARAMETER_SET] = sizeof(uint64_t),
				[GNP_PARAMETER_MODEL] = GNP_MODEL_NAME_MAX + 1};
			size_t size = sizes[parameter->type];
			memset(parsed + parameter->offset, 0xee, size);
			char text[GNP_PARAMETER_DEFAULT_MAX];
			gnp_parameter_default(operation, parameter, text);
			CHECK(gnp_parameter_parse(operation, parsed, parameter->name, text, NULL) == GNP_OK);
		}
		CHECK(memcmp(options, parsed, sizeof options) == 0);
	}
}

/* What core/ has by itself is what texts say: nobody writes the numbers a second time. */
static void default_texts_are_those_of_the_core(void)
{
	const struct gnp_estimate_options e = gnp_estimate_defaults();
	const struct gnp_filter_options f = gnp_filter_defaults();
	const struct gnp_flow_options w = gnp_flow_defaults();
	const struct gnp_poisson_options p = gnp_poisson_defaults();
	const struct {
		const char *operation, *parameter;
		double value; /* NAN: auto */
	} cases[] = {{"estimate", "k", e.k}, {"heat", "degree", e.degree}, {"filter", "alpha", f.alpha},
	             {"filter", "gross", f.gross},
	             {"filter", "cluster", f.cluster}, {"filter", "iterations", f.iterations},
	             {"filter", "tolerance", f.tolerance},
	             {"flow", "steps", w.steps}, {"flow", "dt", w.dt}, {"flow", "smoothing_radius", w.smoothing_radius},
	             {"flow", "spacing", w.spacing}, {"flow", "insertion", w.insertion},
	             {"flow", "tangential", w.tangential},
	             {"flow", "projection", w.projection}, {"flow", "singularity", w.singularity},
	             {"flow", "spacing_limit", w.spacing_limit}, {"poisson", "screening", p.screening},
	             {"poisson", "tolerance", p.tolerance}, {"spectrum", "iterations", p.iterations},
	             {"heat", "drop", p.laplacian.drop},
	             {"laplacian", "stencil", p.laplacian.neighbors}, {"laplacian", "function_degree", p.laplacian.degree}};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
		const struct gnp_operation *operation = gnp_operation_find(cases[i].operation);
		char text[GNP_PARAMETER_DEFAULT_MAX] = "";
		for (size_t k = 0; k < operation->parameter_count; k++)
			if (strcmp(operation->parameters[k].name, cases[i].parameter) == 0)
				gnp_parameter_default(operation, &operation->parameters[k], text);
		if (isnan(cases[i].value))
			CHECK_STRING(text, "auto");
		else
			CHECK_NEAR(strtod(text, NULL), cases[i].value, 0);
	}
}

static void set_bits_are_the_quantities(void)
{
	CHECK(estimate()->output_count == GNP_QUANTITY_COUNT);
	for (int q = 0; q < GNP_QUANTITY_COUNT; q++) {
		const struct gnp_quantity_info *info = gnp_quantity_info(q);
		CHECK_STRING(estimate()->outputs[q].name, info->name);
		CHECK(estimate()->outputs[q].rank == info->rank + 1);
		for (unsigned d = 0; d < info->rank; d++)
			CHECK(estimate()->outputs[q].shape[d + 1] == (info->shape[d] ? (int64_t)info->shape[d] : -2));
	}
}

/* A parameter is named once, and every mask of outputs has room. */
static void tables_are_sound(void)
{
	const struct gnp_operation *operation;
	for (size_t o = 0; (operation = gnp_operation_at(o)) != NULL; o++) {
		CHECK(gnp_operation_find(operation->name) == operation && operation->output_count < 64);
		for (size_t i = 0; i < operation->parameter_count; i++) {
			CHECK(operation->parameters[i].offset < GNP_OPTIONS_SIZE_MAX);
			for (size_t j = 0; j < i; j++)
				CHECK(strcmp(operation->parameters[i].name, operation->parameters[j].name) != 0);
		}
	}
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(parameter_errors_name_value_and_limit),
	                                    TEST(parameters_parse_from_text), TEST(default_texts_equal_the_defaults),
	                                    TEST(default_texts_are_those_of_the_core), TEST(set_bits_are_the_quantities),
	                                    TEST(tables_are_sound)};
	return RUN_TESTS(tests);
}
