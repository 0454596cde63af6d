/* Frozen answers of independent implementations: arrays of doubles in .npz files of tests/data. Tests run in the repository's root. */
#ifndef GNP_TESTS_FROZEN_H
#define GNP_TESTS_FROZEN_H

#include "proto/file/file.h"
#include "tests/unit/test.h"

struct frozen {
	const char *path;
	struct gnp_tensors tensors;
	unsigned char body[1 << 18]; /* what tensors may borrow from */
};

/* The array of a name with so many entries; NULL where there is none that fits. A file that cannot be read ends the program. */
static inline const double *frozen_doubles(struct frozen *frozen, const char *name, size_t count)
{
	if (!frozen->tensors.count) {
		FILE *file = fopen(frozen->path, "rb");
		size_t size = file ? fread(frozen->body, 1, sizeof frozen->body, file) : 0;
		if (file)
			fclose(file);
		if (gnp_file_decode_all(&gnp_format_npz, frozen->body, size, &frozen->tensors, NULL) != GNP_OK) {
			fprintf(stderr, "%s: not there, or damaged\n", frozen->path);
			exit(1);
		}
	}
	const struct gnp_tensor *tensor = gnp_tensors_find(&frozen->tensors, name);
	bool fits = tensor && tensor->datatype == GNP_FP64 && tensor->size == count * sizeof(double);
	return fits ? tensor->data : NULL;
}

#endif
