/* Files of weights: read, written and read again, and made a model of. */
#include "core/model/model.h"
#include "core/model/safetensors.h"
#include "core/model/safetensors_write.h"
#include "tests/fuzz/fuzz.h"

enum { TENSORS = 64, KEYS = 64 };

static void write_again(const struct gnp_safetensors *file)
{
	struct gnp_safetensors_tensor tensors[TENSORS];
	struct gnp_safetensors_metadata metadata[KEYS];
	struct gnp_safetensors_source source = {.metadata = metadata, .tensors = tensors};
	const struct gnp_safetensors_tensor *tensor;
	const struct gnp_safetensors_metadata *key;
	while (source.tensor_count < TENSORS && (tensor = gnp_safetensors_tensor_at(file, source.tensor_count)) != NULL)
		tensors[source.tensor_count++] = *tensor;
	while (source.metadata_count < KEYS && (key = gnp_safetensors_metadata_at(file, source.metadata_count)) != NULL)
		metadata[source.metadata_count++] = *key;
	void *bytes;
	size_t size;
	struct gnp_error error = {0};
	struct gnp_safetensors *back = NULL;
	gnp_status status = gnp_safetensors_encode("again", &source, &bytes, &size, &error);
	if (status != GNP_OK)
		fprintf(stderr, "what was read cannot be written: %s\n", error.text);
	FUZZ_REQUIRE(status == GNP_OK && gnp_safetensors_decode("again", bytes, size, &back, &error) == GNP_OK);
	FUZZ_REQUIRE(gnp_safetensors_tensor_count(back) == source.tensor_count);
	for (size_t i = 0; i < source.tensor_count; i++) {
		const struct gnp_safetensors_tensor *got = gnp_safetensors_tensor_at(back, i);
		FUZZ_REQUIRE(strcmp(got->name, tensors[i].name) == 0 && got->count == tensors[i].count);
		FUZZ_REQUIRE(!got->count || memcmp(got->data, tensors[i].data, got->count * sizeof *got->data) == 0);
	}
	gnp_safetensors_free(back);
	free(bytes);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct gnp_safetensors *file = NULL;
	struct gnp_model *model = NULL;
	struct gnp_error error = {0};
	unsigned char *image = fuzz_copy(data, size);
	gnp_status status = gnp_safetensors_decode("fuzz.safetensors", image, size, &file, &error);
	FUZZ_REQUIRE(status == GNP_OK || error.text[0]);
	if (status == GNP_OK) {
		write_again(file);
		status = gnp_model_create_take(file, &model, &error);
		FUZZ_REQUIRE(status == GNP_OK ? model->parameter_count > 0 : error.text[0] != '\0');
		gnp_model_free(model);
	}
	free(image);
	return 0;
}
