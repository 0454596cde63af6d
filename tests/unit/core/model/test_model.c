/* Models from files: the round trip, every way metadata and tensors can be wrong, sets of models and their references. */
#include "tests/unit/test.h"

#include <pthread.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/base/memory.h"
#include "core/base/random.h"
#include "core/base/task.h"
#include "core/model/models.h"
#include "core/model/safetensors_write.h"

static char folder[64];

static const struct gnp_architecture edge = {
	.trunk = GNP_TRUNK_EDGE, .head = GNP_HEAD_POOLED, .features = 3, .width = 8, .channels = 2, .neurons = 5, .layers = 2,
	.quadrature = 4, .head_width = 6, .outputs = 16};
/* Its supports follow from the cloud: no recipe of patches. */
static const struct gnp_architecture weighted = {
	.trunk = GNP_TRUNK_SEPARABLE, .head = GNP_HEAD_WEIGHTED, .features = 10, .width = 8, .channels = 2, .neurons = 5,
	.layers = 2, .quadrature = 4, .head_width = 6, .node_width = 7, .frame_width = 9, .outputs = 15};
static const struct gnp_recipe recipe = {.k = 30, .buffer = 1.25, .height_scale = 2, .delta0_ratio = 0.13};

/* Lays out an architecture and draws parameters for it, for free(). */
static float *draw_parameters(const struct gnp_architecture *architecture, struct gnp_layout *layout)
{
	struct gnp_random random;
	struct gnp_error error = {0};
	CHECK(gnp_architecture_layout(architecture, layout, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	gnp_random_seed(&random, 7, 0);
	float *parameters = malloc(layout->total * sizeof(float));
	for (size_t i = 0; i < layout->total; i++)
		parameters[i] = (float)(0.1 * gnp_random_normal(&random));
	return parameters;
}

static gnp_status save(const char *name, const struct gnp_architecture *architecture, const struct gnp_safetensors_metadata *more,
                       size_t more_count, struct gnp_error *error)
{
	struct gnp_layout layout;
	char path[128];
	float *parameters = draw_parameters(architecture, &layout);
	snprintf(path, sizeof path, "%s/%s.safetensors", folder, name);
	struct gnp_model_source source = {*architecture, {0}, "clean", more, more_count, parameters};
	if (architecture->head != GNP_HEAD_WEIGHTED)
		source.recipe = recipe;
	gnp_status status = gnp_model_save(path, &source, error);
	free(parameters);
	return status;
}

static void remove_file(const char *name)
{
	char path[128];
	snprintf(path, sizeof path, "%s/%s.safetensors", folder, name);
	CHECK(unlink(path) == 0);
}

static void a_model_that_was_saved_is_loaded(void)
{
	static const struct gnp_safetensors_metadata more[] = {{"training_seed", "42"}, {"note", "a test"}, {"validation_mean_curvature", "0.01"}};
	struct gnp_model *model = NULL;
	struct gnp_error error = {0};
	struct gnp_layout layout;
	char path[128];
	CHECK(save("one.2-x", &edge, more, 3, &error) == GNP_OK);
	snprintf(path, sizeof path, "%s/one.2-x.safetensors", folder);
	CHECK(gnp_model_load(path, &model, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	if (model) {
		float *parameters = draw_parameters(&edge, &layout);
		CHECK_STRING(model->name, "one.2-x");
		CHECK_STRING(model->regime, "clean");
		CHECK(strlen(model->sha256) == 64 && model->network && model->parameter_count == layout.total);
		CHECK(model->architecture.trunk == edge.trunk && model->architecture.head == edge.head);
		CHECK(model->architecture.width == 8 && model->architecture.channels == 2 && model->architecture.neurons == 5);
		CHECK(model->architecture.layers == 2 && model->architecture.quadrature == 4 && model->architecture.outputs == 16);
		CHECK(model->architecture.features == 3 && model->architecture.head_width == 6);
		CHECK(model->recipe.k == 30 && model->recipe.buffer == 1.25 && model->recipe.height_scale == 2);
		CHECK(model->recipe.delta0_ratio == 0.13 && model->recipe.delta0 == 0);
		CHECK(memcmp(model->network->parameters, parameters, layout.total * sizeof(float)) == 0);
		CHECK_STRING(gnp_safetensors_metadata_find(model->file, "training_seed"), "42");
		free(parameters);
	}
	gnp_model_free(model);
	remove_file("one.2-x");
}

static void the_shells_of_a_projection_are_kept(void)
{
	static const struct {
		unsigned count, shell[GNP_SHELLS_MAX];
		const char *text;
	} rows[] = {{1, {8}, "8"}, {3, {30, 50, 4096}, "30,50,4096"}, {8, {1001, 1002, 1003, 1004, 1005, 1006, 1007, 1008}, "1001,1002,1003,1004,1005,1006,1007,1008"}};
	for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
		struct gnp_architecture architecture = edge;
		struct gnp_model *model = NULL;
		char path[128];
		architecture.head = GNP_HEAD_PROJECTION;
		architecture.features = 4;
		architecture.ridge = 2e-5;
		architecture.shells = rows[i].count;
		memcpy(architecture.shell, rows[i].shell, sizeof architecture.shell);
		architecture.outputs = (unsigned)gnp_projection_outputs(&architecture);
		CHECK(save("p", &architecture, NULL, 0, NULL) == GNP_OK);
		snprintf(path, sizeof path, "%s/p.safetensors", folder);
		CHECK(gnp_model_load(path, &model, NULL) == GNP_OK);
		if (model) {
			CHECK_STRING(gnp_safetensors_metadata_find(model->file, "shells"), rows[i].text);
			CHECK(model->architecture.head == GNP_HEAD_PROJECTION && model->architecture.shells == rows[i].count);
			CHECK(model->architecture.ridge == architecture.ridge);
			CHECK(memcmp(model->architecture.shell, architecture.shell, rows[i].count * sizeof *architecture.shell) == 0);
		}
		gnp_model_free(model);
		remove_file("p");
	}
}

/* Its file has no keys of a trunk, and one that has is refused. */
static void a_model_without_a_trunk_is_kept(void)
{
	static const struct gnp_architecture architecture = {.trunk = GNP_TRUNK_NONE,
	                                                     .head = GNP_HEAD_PROJECTION,
	                                                     .head_width = 6,
	                                                     .outputs = 9,
	                                                     .shells = 1,
	                                                     .shell = {50},
	                                                     .ridge = 1e-12};
	const struct gnp_safetensors_metadata metadata[] = {
		{"gnp_format", "1"}, {"head", "projection"}, {"trunk", "none"}, {"width", "8"}};
	const struct gnp_safetensors_source source = {metadata, 4, NULL, 0};
	struct gnp_safetensors *file = NULL;
	struct gnp_model *model = NULL;
	struct gnp_error error = {0};
	void *bytes = NULL;
	size_t size = 0;
	char path[128];
	CHECK(save("n", &architecture, NULL, 0, &error) == GNP_OK);
	snprintf(path, sizeof path, "%s/n.safetensors", folder);
	CHECK(gnp_model_load(path, &model, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	if (model) {
		CHECK(model->architecture.trunk == GNP_TRUNK_NONE && model->architecture.width == 0 &&
		      model->architecture.layers == 0);
		CHECK(!gnp_safetensors_metadata_find(model->file, "width") &&
		      !gnp_safetensors_metadata_find(model->file, "quadrature"));
	}
	gnp_model_free(model);
	remove_file("n");
	CHECK(gnp_safetensors_encode("n", &source, &bytes, &size, NULL) == GNP_OK);
	CHECK(gnp_safetensors_decode("n", bytes, size, &file, NULL) == GNP_OK);
	CHECK(gnp_model_create_take(file, &model, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "metadata \"width\": got \"8\", need none with the trunk none");
	free(bytes);
}

static void a_weighted_model_is_kept_without_a_recipe(void)
{
	static const char *const absent[] = {"k", "buffer", "height_scale", "delta0", "delta0_ratio", "shells", "ridge"};
	struct gnp_model *model = NULL;
	struct gnp_error error = {0};
	struct gnp_layout layout;
	char path[128];
	CHECK(save("w", &weighted, NULL, 0, &error) == GNP_OK);
	snprintf(path, sizeof path, "%s/w.safetensors", folder);
	CHECK(gnp_model_load(path, &model, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	if (model) {
		float *parameters = draw_parameters(&weighted, &layout);
		for (size_t i = 0; i < sizeof absent / sizeof absent[0]; i++)
			CHECK(!gnp_safetensors_metadata_find(model->file, absent[i]));
		CHECK_STRING(gnp_safetensors_metadata_find(model->file, "head"), "weighted");
		CHECK(memcmp(&model->architecture, &weighted, sizeof weighted) == 0 && model->recipe.k == 0 &&
		      model->recipe.delta0 == 0);
		CHECK(memcmp(model->network->parameters, parameters, layout.total * sizeof(float)) == 0);
		free(parameters);
	}
	gnp_model_free(model);
	remove_file("w");
}

static void shells_that_are_no_list_are_refused(void)
{
	static const char *const bad[] = {"", ",", "30,", ",30", "30,,50", "30 50", "30,-50", "a", "9,10,11,12,13,14,15,16,17"};
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
		const struct gnp_safetensors_metadata metadata[] = {
			{"gnp_format", "1"}, {"trunk", "edge"}, {"head", "projection"}, {"features", "3"}, {"width", "8"}, {"channels", "2"},
			{"neurons", "5"}, {"layers", "2"}, {"quadrature", "4"}, {"head_width", "6"}, {"outputs", "10"}, {"shells", bad[i]}};
		const struct gnp_safetensors_source source = {metadata, sizeof metadata / sizeof metadata[0], NULL, 0};
		struct gnp_safetensors *file = NULL;
		struct gnp_model *model = NULL;
		struct gnp_error error = {0};
		void *bytes = NULL;
		size_t size = 0;
		CHECK(gnp_safetensors_encode("p", &source, &bytes, &size, NULL) == GNP_OK);
		CHECK(gnp_safetensors_decode("p", bytes, size, &file, NULL) == GNP_OK);
		CHECK(gnp_model_create_take(file, &model, &error) == GNP_INVALID_ARGUMENT && !model);
		CHECK_CONTAINS(error.text, "p: metadata \"shells\": got");
		free(bytes);
	}
}

/* ---- Files that are wrong in one place ---- */

static const struct gnp_safetensors_metadata good[] = {
	{"gnp_format", "1"}, {"trunk", "edge"}, {"head", "pooled"}, {"features", "3"}, {"width", "8"}, {"channels", "2"},
	{"neurons", "5"}, {"layers", "2"}, {"quadrature", "4"}, {"head_width", "6"}, {"outputs", "16"}, {"k", "30"}, {"buffer", "1.25"},
	{"height_scale", "2"}, {"delta0", "0.005"}, {"regime", "clean"}, {"format", "pt"}};
enum { GOOD = sizeof good / sizeof good[0] };

static const struct gnp_safetensors_metadata good_weighted[] = {
	{"gnp_format", "1"}, {"trunk", "separable"}, {"head", "weighted"}, {"features", "10"},  {"width", "8"},
	{"channels", "2"},   {"neurons", "5"},       {"layers", "2"},      {"quadrature", "4"}, {"head_width", "6"},
	{"outputs", "15"},   {"node_width", "7"},    {"frame_width", "9"}, {"regime", "any"}};
enum { GOOD_WEIGHTED = sizeof good_weighted / sizeof good_weighted[0] };

struct fault {
	const char *key, *value; /* metadata to replace or add; NULL value: to leave out */
	const char *tensor;      /* to leave out, or with rename to call so, or with transpose to turn */
	const char *rename;
	bool transpose;
	const char *part; /* of the message; NULL: there is none */
};

/* Of a file that is right but for the fault. */
static void check_fault_of(const struct gnp_architecture *architecture, const struct gnp_safetensors_metadata *right,
                           size_t right_count, const struct fault *fault)
{
	struct gnp_safetensors_metadata metadata[GOOD + GOOD_WEIGHTED];
	struct gnp_safetensors_tensor tensors[GNP_PARAMETER_ROWS_MAX];
	struct gnp_layout layout;
	size_t metadata_count = 0, tensor_count = 0;
	bool replaced = !fault->key;
	float *parameters = draw_parameters(architecture, &layout);
	for (size_t i = 0; i < right_count; i++) {
		bool hit = fault->key && strcmp(right[i].key, fault->key) == 0;
		replaced = replaced || hit;
		if (!hit)
			metadata[metadata_count++] = right[i];
		else if (fault->value)
			metadata[metadata_count++] = (struct gnp_safetensors_metadata){fault->key, fault->value};
	}
	if (!replaced)
		metadata[metadata_count++] = (struct gnp_safetensors_metadata){fault->key, fault->value};
	for (size_t i = 0; i < layout.rows; i++) {
		const struct gnp_parameter_row *row = &layout.row[i];
		struct gnp_safetensors_tensor *tensor = &tensors[tensor_count];
		bool hit = fault->tensor && strcmp(row->name, fault->tensor) == 0;
		*tensor = (struct gnp_safetensors_tensor){.name = hit && fault->rename ? fault->rename : row->name, .rank = row->rank,
		                                      .data = parameters + row->offset};
		for (size_t d = 0; d < row->rank; d++)
			tensor->shape[d] = row->shape[hit && fault->transpose ? row->rank - 1 - d : d];
		tensor_count += !hit || fault->rename || fault->transpose;
	}
	const struct gnp_safetensors_source source = {metadata, metadata_count, tensors, tensor_count};
	struct gnp_safetensors *file = NULL;
	struct gnp_model *model = NULL;
	struct gnp_error error = {0};
	void *bytes = NULL;
	size_t size = 0;
	CHECK(gnp_safetensors_encode("w/bad.safetensors", &source, &bytes, &size, &error) == GNP_OK);
	CHECK(bytes && gnp_safetensors_decode("w/bad.safetensors", bytes, size, &file, &error) == GNP_OK);
	if (file) {
		gnp_status status = gnp_model_create_take(file, &model, &error);
		CHECK(status == (fault->part ? GNP_INVALID_ARGUMENT : GNP_OK));
		CHECK(!fault->part == (model != NULL));
		CHECK_CONTAINS(error.text, fault->part ? "w/bad.safetensors: " : "");
		CHECK_CONTAINS(error.text, fault->part ? fault->part : "");
	}
	gnp_model_free(model);
	free(bytes);
	free(parameters);
}

static void check_fault(const struct fault *fault)
{
	check_fault_of(&edge, good, GOOD, fault);
}

static void wrong_metadata_is_refused_by_key(void)
{
	static const struct fault faults[] = {
		{.key = NULL},
		{"note_of_mine", "anything", .part = NULL},
		{"gnp_format", NULL, .part = "metadata \"gnp_format\": got none, need 1"},
		{"gnp_format", "2", .part = "metadata \"gnp_format\": got \"2\", need 1"},
		{"trunk", NULL, .part = "metadata \"trunk\": got none, need edge or separable"},
		{"trunk", "Edge", .part = "metadata \"trunk\": got \"Edge\", need edge or separable"},
		{"head", "polled", .part = "metadata \"head\": got \"polled\", need pooled or projection or weighted"},
		{"node_width", "8", .part = "metadata \"node_width\": got \"8\", need none with the head pooled"},
		{"frame_width", "8", .part = "metadata \"frame_width\": got \"8\", need none with the head pooled"},
		{"width", "", .part = "metadata \"width\": got \"\", need an integer of at least 1"},
		{"width", "8.0", .part = "metadata \"width\": got \"8.0\", need an integer"},
		{"width", "-8", .part = "metadata \"width\": got \"-8\", need an integer"},
		{"width", " 8", .part = "metadata \"width\": got \" 8\", need an integer"},
		{"width", "0x8", .part = "metadata \"width\": got \"0x8\", need an integer"},
		{"width", "99999999999999999999", .part = "metadata \"width\": got \"99999999999999999999\", need an integer"},
		{"layers", "0", .part = "metadata \"layers\": got \"0\", need an integer of at least 1"},
		{"quadrature", "65", .part = "metadata: quadrature: got 65, need 4..64"},
		{"channels", "3", .part = "metadata: width: got 8, need a multiple of the 3 channels"},
		{"shells", "30,50", .part = "metadata \"shells\": got \"30,50\", need none with the head pooled"},
		{"outputs", NULL, .part = "metadata \"outputs\": got none"},
		{"k", "11", .part = "metadata \"k\": got \"11\", need an integer of 12..500"},
		{"buffer", "nan", .part = "metadata \"buffer\": got \"nan\", need a number of 1..4"},
		{"buffer", "1.2.3", .part = "metadata \"buffer\": got \"1.2.3\", need a number"},
		{"buffer", "1e", .part = "metadata \"buffer\": got \"1e\", need a number"},
		{"buffer", "0.9", .part = "metadata \"buffer\": got \"0.9\", need a number of 1..4"},
		{"height_scale", "0", .part = "metadata \"height_scale\": got \"0\", need a number"},
		{"delta0", NULL, .part = "metadata \"delta0\" and \"delta0_ratio\": got none, need one of them"},
		{"delta0_ratio", "0.1", .part = "metadata \"delta0\" and \"delta0_ratio\": got both, need one of them"},
		{"delta0", "0", .part = "metadata \"delta0\": got \"0\", need a number of 1e-12..1e+12"},
		{"regime", "", .part = "metadata \"regime\": got \"\", need 1..63 of"},
		{"regime", "a b", .part = "metadata \"regime\": got \"a b\", need"},
		{"height_scael", "2", .part = "metadata \"height_scael\": unknown key, need one of weights/README.md"},
	};
	for (size_t i = 0; i < sizeof faults / sizeof faults[0]; i++)
		check_fault(&faults[i]);
}

static void keys_of_patches_are_not_for_the_head_weighted(void)
{
	static const struct fault faults[] = {
		{.key = NULL},
		{"k", "30", .part = "metadata \"k\": got \"30\", need none with the head weighted"},
		{"buffer", "1.25", .part = "metadata \"buffer\": got \"1.25\", need none with the head weighted"},
		{"height_scale", "2", .part = "metadata \"height_scale\": got \"2\", need none with the head weighted"},
		{"shells", "30,50", .part = "metadata \"shells\": got \"30,50\", need none with the head weighted"},
		{"ridge", "1e-6", .part = "metadata \"ridge\": got \"1e-6\", need none with the head weighted"},
		{"delta0", "0.1", .part = "metadata \"delta0\" and \"delta0_ratio\": got one, need none of them"},
		{"delta0_ratio", "0.1", .part = "metadata \"delta0\" and \"delta0_ratio\": got one, need none of them"},
		{"node_width", NULL, .part = "metadata \"node_width\": got none, need an integer of at least 1"},
		{"frame_width", "0", .part = "metadata \"frame_width\": got \"0\", need an integer of at least 1"},
		{"frame_width", "2000", .part = "metadata: frame_width: got 2000, need 4..1024"},
		{"outputs", "16", .part = "metadata: outputs: got 16, need 15..15"},
		{"trunk", "edge", .part = "metadata: trunk: got edge, the head weighted needs separable"},
		{"node_width", "8", .part = "tensor \"node.0.weight\": shape: got [7,18], need [8,18]"},
		{.tensor = "frame.mean", .part = "tensor \"frame.mean\": missing, need shape [44]"},
	};
	for (size_t i = 0; i < sizeof faults / sizeof faults[0]; i++)
		check_fault_of(&weighted, good_weighted, GOOD_WEIGHTED, &faults[i]);
}

static void wrong_tensors_are_refused_by_name(void)
{
	struct gnp_layout layout;
	char missing[128], turned[128];
	size_t matrix = 0;
	float *parameters = draw_parameters(&edge, &layout);
	while (matrix < layout.rows && !(layout.row[matrix].rank == 2 && layout.row[matrix].shape[0] != layout.row[matrix].shape[1]))
		matrix++;
	CHECK(matrix < layout.rows);
	const struct gnp_parameter_row *row = &layout.row[matrix];
	snprintf(missing, sizeof missing, "tensor \"%s\": missing, need shape [%zu,%zu]", row->name, row->shape[0], row->shape[1]);
	snprintf(turned, sizeof turned, "tensor \"%s\": shape: got [%zu,%zu], need [%zu,%zu]", row->name, row->shape[1], row->shape[0],
	         row->shape[0], row->shape[1]);
	check_fault(&(struct fault){.tensor = row->name, .part = missing});
	check_fault(&(struct fault){.tensor = row->name, .rename = "odd", .part = missing});
	check_fault(&(struct fault){.tensor = row->name, .transpose = true, .part = turned});
	check_fault(&(struct fault){"layers", "1", .part = "unknown, the trunk edge of 1 layers with the head pooled has"});
	check_fault(&(struct fault){"layers", "3", .part = "missing, need shape"});
	check_fault(&(struct fault){"head_width", "7", .part = "shape: got [6"});
	free(parameters);
}

/* Any byte of the header becomes another one: a model or an answer that names the file, and nothing else. */
static void damaged_headers_are_answered(void)
{
	unsigned char bytes[8192];
	char path[128];
	size_t models = 0, refused = 0;
	struct gnp_random random;
	CHECK(save("d", &edge, NULL, 0, NULL) == GNP_OK);
	snprintf(path, sizeof path, "%s/d.safetensors", folder);
	FILE *file = fopen(path, "rb");
	size_t size = file ? fread(bytes, 1, sizeof bytes, file) : 0;
	CHECK(file && fclose(file) == 0 && size > 2000 && size < sizeof bytes);
	size_t header = (size_t)bytes[0] + 256 * (size_t)bytes[1];
	gnp_random_seed(&random, 11, 0);
	for (int round = 0; round < 4000; round++) {
		static const char telling[] = "0123456789-.,eE[]{}\"_ abcdefghijklmnopqrstuvwxyz";
		struct gnp_safetensors *damaged = NULL;
		struct gnp_model *model = NULL;
		struct gnp_error error = {0};
		size_t at = 8 + (size_t)gnp_random_below(&random, header);
		unsigned char before = bytes[at];
		bytes[at] = (unsigned char)telling[gnp_random_below(&random, sizeof telling - 1)];
		if (gnp_safetensors_decode("w/d.safetensors", bytes, size, &damaged, &error) == GNP_OK)
			gnp_model_create_take(damaged, &model, &error);
		CHECK(!model == (error.status != GNP_OK));
		if (!model)
			CHECK_CONTAINS(error.text, "w/d.safetensors: ");
		models += model != NULL;
		refused += model == NULL;
		gnp_model_free(model);
		bytes[at] = before;
	}
	CHECK(models > 20 && refused > 2000);
	remove_file("d");
}

static void what_no_reader_takes_is_not_saved(void)
{
	static const struct gnp_safetensors_metadata unknown = {"heihgt", "1"};
	struct gnp_error key = {0}, range = {0};
	CHECK(save("no", &edge, &unknown, 1, &key) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(key.text, "no.safetensors: metadata \"heihgt\": unknown key");
	struct gnp_layout layout;
	float *parameters = draw_parameters(&edge, &layout);
	const struct gnp_model_source source = {edge, {.k = 3, .buffer = 1, .height_scale = 1, .delta0 = 1}, "x", NULL, 0, parameters};
	CHECK(gnp_model_save("/nowhere/no.safetensors", &source, &range) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(range.text, "metadata \"k\": got \"3\", which no reader takes");
	struct gnp_model_source both = source;
	struct gnp_error two = {0}, one = {0};
	both.recipe = (struct gnp_recipe){.k = 30, .buffer = 1, .height_scale = 1, .delta0 = 1, .delta0_ratio = 1};
	CHECK(gnp_model_save("/nowhere/no.safetensors", &both, &two) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(two.text, "no.safetensors: metadata \"delta0\" and \"delta0_ratio\": got both, need one of them");
	both.architecture = weighted;
	both.recipe.delta0 = 0;
	CHECK(gnp_model_save("/nowhere/no.safetensors", &both, &one) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(one.text, "metadata \"delta0\" and \"delta0_ratio\": got one, need none of them");
	free(parameters);
}

static void names_of_models_are_those_of_their_files(void)
{
	static const char *const bad[] = {"", ".x", "-x", "a b", "a/b", "caf\xc3\xa9", "a\"b",
	                                  "0123456789012345678901234567890123456789012345678901234567890123"};
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
		CHECK(!gnp_model_name_fits(bad[i]));
	CHECK(gnp_model_name_fits("fit_clean_50k") && gnp_model_name_fits("0.a-B_"));
	struct gnp_model *model = NULL;
	struct gnp_error error = {0};
	char path[128];
	CHECK(save("b d", &edge, NULL, 0, NULL) == GNP_OK);
	snprintf(path, sizeof path, "%s/b d.safetensors", folder);
	CHECK(gnp_model_load(path, &model, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "b d.safetensors: its name: need 1..63");
	remove_file("b d");
}

/* ---- Sets ---- */

static void a_folder_is_a_set_in_the_order_of_names(void)
{
	struct gnp_models *models = NULL;
	struct gnp_error error = {0}, unknown = {0};
	const struct gnp_model *model = NULL;
	char path[128];
	CHECK(save("b", &edge, NULL, 0, NULL) == GNP_OK && save("a", &edge, NULL, 0, NULL) == GNP_OK);
	snprintf(path, sizeof path, "%s/README.md", folder);
	FILE *other = fopen(path, "w");
	CHECK(other && fclose(other) == 0);
	CHECK(gnp_models_load(folder, &models, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	CHECK_STRING(gnp_models_folder(models), folder);
	CHECK(gnp_models_count(models) == 2 && !gnp_models_at(models, 2));
	if (gnp_models_count(models) == 2) {
		CHECK_STRING(gnp_models_at(models, 0)->name, "a");
		CHECK_STRING(gnp_models_at(models, 1)->name, "b");
		CHECK_STRING(gnp_models_at(models, 0)->sha256, gnp_models_at(models, 1)->sha256);
	}
	CHECK(gnp_models_find(models, "b", &model, NULL) == GNP_OK && model == gnp_models_at(models, 1));
	CHECK(gnp_models_find(models, "c", &model, &unknown) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(unknown.text, "weights: got \"c\", known: a, b");
	gnp_models_release(models);
	unlink(path);
	remove_file("a");
	remove_file("b");
}

static void one_bad_file_is_no_set(void)
{
	struct gnp_models *models = NULL;
	struct gnp_error error = {0};
	char path[128];
	CHECK(save("a", &edge, NULL, 0, NULL) == GNP_OK);
	snprintf(path, sizeof path, "%s/b.safetensors", folder);
	FILE *bad = fopen(path, "w");
	CHECK(bad && fputs("\xff\xff\xff\xff\xff\xff\xff\xff{}", bad) >= 0 && fclose(bad) == 0);
	CHECK(gnp_models_load(folder, &models, &error) == GNP_INVALID_ARGUMENT && !models);
	CHECK_CONTAINS(error.text, "/b.safetensors: header length: got 18446744073709551615");
	remove_file("a");
	remove_file("b");
}

static void no_folder_is_an_error_and_an_empty_one_an_empty_set(void)
{
	struct gnp_models *models = NULL;
	struct gnp_error error = {0}, unknown = {0};
	const struct gnp_model *model;
	CHECK(gnp_models_load("/nowhere/at/all", &models, &error) == GNP_IO);
	CHECK_CONTAINS(error.text, "/nowhere/at/all: No such file or directory");
	CHECK(gnp_models_load(folder, &models, NULL) == GNP_OK && gnp_models_count(models) == 0);
	CHECK(gnp_models_find(models, "a", &model, &unknown) == GNP_UNAVAILABLE);
	CHECK_STRING(unknown.text, "weights: got \"a\", known: none are loaded");
	CHECK(gnp_models_find(NULL, "a", &model, NULL) == GNP_UNAVAILABLE);
	gnp_models_release(models);
	gnp_models_release(NULL);
}

/* The best of three, because others use the machine too. */
static void what_is_shipped_loads_in_a_fifth_of_a_second(void)
{
	double best = INFINITY;
	for (int i = 0; i < 3; i++) {
		struct gnp_models *models = NULL;
		struct gnp_error error = {0};
		double start = gnp_clock();
		CHECK(gnp_models_load("weights", &models, &error) == GNP_OK); /* tests run in the repository's root */
		CHECK_STRING(error.text, "");
		best = fmin(best, gnp_clock() - start);
		gnp_models_release(models);
	}
#if !defined __SANITIZE_ADDRESS__ && !defined __SANITIZE_THREAD__
	CHECK_AT_MOST(best, 0.2);
#endif
}

static void *hold_and_let_go(void *models)
{
	for (int i = 0; i < 20000; i++) {
		struct gnp_models *mine = gnp_models_retain(models);
		if (gnp_models_count(mine) != 1)
			return mine;
		gnp_models_release(mine);
	}
	gnp_models_release(models);
	return NULL;
}

static void the_last_of_many_threads_frees_the_set(void)
{
	enum { THREADS = 4 };
	struct gnp_models *models = NULL;
	pthread_t threads[THREADS];
	void *wrong;
	CHECK(save("a", &edge, NULL, 0, NULL) == GNP_OK && gnp_models_load(folder, &models, NULL) == GNP_OK);
	for (int i = 0; i < THREADS; i++)
		CHECK(pthread_create(&threads[i], NULL, hold_and_let_go, gnp_models_retain(models)) == 0);
	gnp_models_release(models);
	for (int i = 0; i < THREADS; i++)
		CHECK(pthread_join(threads[i], &wrong) == 0 && !wrong);
	remove_file("a");
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(a_model_that_was_saved_is_loaded),
	                                    TEST(a_model_without_a_trunk_is_kept),
	                                    TEST(the_shells_of_a_projection_are_kept),
	                                    TEST(a_weighted_model_is_kept_without_a_recipe),
	                                    TEST(keys_of_patches_are_not_for_the_head_weighted),
	                                    TEST(shells_that_are_no_list_are_refused),
	                                    TEST(wrong_metadata_is_refused_by_key),
	                                    TEST(wrong_tensors_are_refused_by_name),
	                                    TEST(damaged_headers_are_answered),
	                                    TEST(what_no_reader_takes_is_not_saved),
	                                    TEST(names_of_models_are_those_of_their_files),
	                                    TEST(a_folder_is_a_set_in_the_order_of_names),
	                                    TEST(one_bad_file_is_no_set),
	                                    TEST(no_folder_is_an_error_and_an_empty_one_an_empty_set),
	                                    TEST(what_is_shipped_loads_in_a_fifth_of_a_second),
	                                    TEST(the_last_of_many_threads_frees_the_set)};
	strcpy(folder, "/tmp/gnp-model-XXXXXX");
	if (!mkdtemp(folder))
		return 1;
	int failed = RUN_TESTS(tests);
	return rmdir(folder) == 0 ? failed : 1;
}
