/* NPZ: a zip file of NPY arrays, in memory, by libzip. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zip.h>
#include <zlib.h>

#include "core/base/memory.h"
#include "proto/codec/comments.h"
#include "proto/codec/parameters.h"
#include "proto/format/format.h"
#include "proto/format/npy.h"
#include "proto/format/sparse.h"

enum {
	ENTRIES_MAX = 4096,
	HEADER_MAX = 65536 + 12,
	DEFLATE_RATIO_MAX = 1032 /* no deflate stream expands further */
};

/* What libzip's complaint is: of memory, or of the bytes. Not every want of memory is given a code. */
static gnp_status status_of(zip_error_t *reason)
{
	int code = zip_error_code_zip(reason);
	bool inflate = code == ZIP_ER_ZLIB && zip_error_code_system(reason) == Z_MEM_ERROR;
	return code == ZIP_ER_MEMORY || code == ZIP_ER_OK || inflate ? GNP_OUT_OF_MEMORY : GNP_INVALID_ARGUMENT;
}

/* An entry that could not be read: for want of memory, or for what `text` says. */
static gnp_status bad_entry(zip_file_t *file, const char *text, struct gnp_error *error)
{
	zip_error_t *reason = zip_file_get_error(file);
	if (zip_error_code_zip(reason) != ZIP_ER_OK && status_of(reason) == GNP_OUT_OF_MEMORY)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "npz: no memory to read an entry");
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "npz: %s", text);
}

/* Entries of a directory, as their signatures tell: libzip makes something of each of them before it can be asked
 * how many there are. */
static size_t count_signatures(const unsigned char *data, size_t size)
{
	const unsigned char *p = data, *end = data + size;
	size_t count = 0;
	while (count <= ENTRIES_MAX && (p = memmem(p, (size_t)(end - p), "PK\1\2", 4)) != NULL) {
		count++;
		p += 4;
	}
	return count;
}

/* Opens memory as an archive; source data stays the caller's. */
static gnp_status open_memory(const void *data, size_t size, int flags, zip_source_t **source, zip_t **out,
                              struct gnp_error *error)
{
	zip_error_t reason;
	gnp_status status = GNP_OK;
	zip_error_init(&reason);
	*source = zip_source_buffer_create(data, size, 0, &reason);
	zip_t *archive = *source ? zip_open_from_source(*source, flags, &reason) : NULL;
	if (!archive) {
		status = gnp_error_set(error, status_of(&reason), "npz: %s", zip_error_strerror(&reason));
		zip_source_free(*source);
	}
	zip_error_fini(&reason);
	*out = archive;
	return status;
}

static bool read_exactly(zip_file_t *file, unsigned char *target, size_t size)
{
	while (size) {
		zip_int64_t got = zip_fread(file, target, size);
		if (got <= 0)
			return false;
		target += got;
		size -= (size_t)got;
	}
	return true;
}

/* Past the data there must be nothing; reading up to the end also has libzip compare the checksum. */
static bool at_end(zip_file_t *file)
{
	unsigned char beyond;
	return zip_fread(file, &beyond, 1) == 0;
}

/* The header in full, with head (HEADER_MAX) holding its bytes. */
static gnp_status read_header(zip_file_t *file, unsigned char *head, struct gnp_npy *npy, struct gnp_error *error)
{
	if (!read_exactly(file, head, 12))
		return bad_entry(file, "an entry is cut short", error);
	size_t length = head[8] | (size_t)head[9] << 8, start = 10;
	if (head[6] > 1) {
		length |= (size_t)head[10] << 16 | (size_t)head[11] << 24;
		start = 12;
	}
	if (length < 2 || length + start > HEADER_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "npz: an array's header has %zu bytes, need at most %d",
		                     length, HEADER_MAX - 12);
	if (!read_exactly(file, head + 12, start + length - 12))
		return bad_entry(file, "an entry is cut short", error);
	return gnp_npy_read_header(head, start + length, npy, error);
}

static gnp_status check_entry(const zip_stat_t *entry, struct gnp_error *error)
{
	zip_uint64_t need = ZIP_STAT_SIZE | ZIP_STAT_COMP_SIZE | ZIP_STAT_COMP_METHOD | ZIP_STAT_ENCRYPTION_METHOD;
	if ((entry->valid & need) != need || entry->encryption_method != ZIP_EM_NONE ||
	    (entry->comp_method != ZIP_CM_STORE && entry->comp_method != ZIP_CM_DEFLATE))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "npz: \"%.60s\": need a stored or deflated entry",
		                     entry->name);
	if (entry->size / DEFLATE_RATIO_MAX > entry->comp_size)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "npz: \"%.60s\": claims %llu bytes out of %llu", entry->name,
		                     (unsigned long long)entry->size, (unsigned long long)entry->comp_size);
	return GNP_OK;
}

/* What can be said of an array before it is inflated: a body of a few bytes may claim any shape. */
static gnp_status check_array(const struct gnp_npy *npy, const zip_stat_t *entry, const char *name,
                              const struct gnp_decode *decode, struct gnp_error *error)
{
	if (npy->bytes > entry->size || npy->bytes + npy->header != entry->size)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "npz: \"%.60s\": the shape needs %zu bytes, the entry has %llu with its header",
		                     entry->name, npy->bytes, (unsigned long long)entry->size);
	if (decode->all)
		return GNP_OK;
	const struct gnp_tensor_info *input = gnp_decode_input(decode, name);
	gnp_status status = input ? gnp_npy_check_input(npy, input, error) : gnp_npy_check_vectors(npy, name, error);
	return status == GNP_OK ? gnp_decode_check_points(decode, npy->shape[0], error) : status;
}

/* Inflates an entry's data (bytes), which is owned by the caller and reserved of the budget. */
static gnp_status inflate_array(zip_file_t *file, const zip_stat_t *entry, size_t bytes,
                                const struct gnp_budget *budget, unsigned char **out, struct gnp_error *error)
{
	gnp_status status = gnp_budget_reserve(budget, bytes, error);
	if (status != GNP_OK)
		return status;
	unsigned char *data = gnp_array_new(bytes, 1);
	if (!data)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "npz: \"%.60s\": no memory for %zu bytes", entry->name, bytes);
	if (!read_exactly(file, data, bytes) || !at_end(file)) {
		char text[96];
		free(data);
		snprintf(text, sizeof text, "\"%.60s\": corrupt or cut short", entry->name);
		return bad_entry(file, text, error);
	}
	*out = data;
	return GNP_OK;
}

/* What an answer says of itself, which is no tensor of it. */
static bool is_report(const char *name, const struct gnp_npy *npy)
{
	return strcmp(name, GNP_PARAMETERS_NAME) == 0 && npy->datatype == GNP_UINT8 && npy->rank == 1;
}

static gnp_status read_array(zip_file_t *file, const zip_stat_t *entry, const char *name,
                             const struct gnp_decode *decode, struct gnp_tensors *tensors, struct gnp_error *error)
{
	unsigned char *head = gnp_array_new(HEADER_MAX, 1), *data = NULL;
	struct gnp_npy npy;
	gnp_status status = head ? read_header(file, head, &npy, error)
	                         : gnp_error_set(error, GNP_OUT_OF_MEMORY, "npz: no memory for a header");
	free(head);
	if (status == GNP_OK && decode->all && is_report(name, &npy))
		return GNP_OK;
	if (status == GNP_OK)
		status = check_array(&npy, entry, name, decode, error);
	if (status == GNP_OK)
		status = inflate_array(file, entry, npy.bytes, tensors->budget, &data, error);
	if (status != GNP_OK)
		return status;
	status = gnp_npy_add(&npy, name, data, true, tensors, error);
	bool vectors = !decode->all && !gnp_decode_input(decode, name);
	return status == GNP_OK && vectors ? gnp_npy_split_vectors(tensors, name, error) : status;
}

/* The tensor an entry becomes; false when it is not wanted. */
static bool entry_name(const struct gnp_decode *decode, const char *entry, char name[GNP_TENSOR_NAME_MAX])
{
	size_t length = strlen(entry);
	if (length > 4 && strcmp(entry + length - 4, ".npy") == 0)
		length -= 4;
	if (length == 0 || length >= GNP_TENSOR_NAME_MAX)
		return false;
	memcpy(name, entry, length);
	name[length] = '\0';
	if (decode->all) /* "format" is a text, of sparse matrices */
		return strcmp(name, "format") != 0;
	const struct gnp_tensor_info *input = gnp_decode_input(decode, name);
	if (input)
		strcpy(name, input->name);
	if (strcmp(name, "xyz") == 0)
		strcpy(name, "points");
	return input || strcmp(name, "points") == 0 || strcmp(name, "normals") == 0;
}

static gnp_status read_entry(zip_t *archive, zip_uint64_t index, const struct gnp_decode *decode,
                             struct gnp_tensors *tensors, struct gnp_error *error)
{
	zip_stat_t entry;
	char name[GNP_TENSOR_NAME_MAX];
	if (zip_stat_index(archive, index, 0, &entry) != 0 || !(entry.valid & ZIP_STAT_NAME))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "npz: entry %llu cannot be read", (unsigned long long)index);
	if (!entry_name(decode, entry.name, name) || gnp_tensors_find(tensors, name))
		return GNP_OK;
	gnp_status status = check_entry(&entry, error);
	if (status != GNP_OK)
		return status;
	zip_file_t *file = zip_fopen_index(archive, index, 0);
	if (!file)
		return gnp_error_set(error, status_of(zip_get_error(archive)), "npz: \"%.60s\": %s", entry.name,
		                     zip_strerror(archive));
	status = read_array(file, &entry, name, decode, tensors, error);
	zip_fclose(file);
	return status;
}

static gnp_status decode_file(const struct gnp_decode *decode, struct gnp_tensors *tensors, struct gnp_error *error)
{
	zip_source_t *source;
	zip_t *archive;
	if (count_signatures(decode->body, decode->size) > ENTRIES_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "npz: more than %d entries", ENTRIES_MAX);
	gnp_status status = open_memory(decode->body, decode->size, ZIP_RDONLY, &source, &archive, error);
	if (status != GNP_OK)
		return status;
	zip_int64_t count = zip_get_num_entries(archive, 0);
	for (zip_int64_t i = 0; i < count && status == GNP_OK; i++)
		status = read_entry(archive, (zip_uint64_t)i, decode, tensors, error);
	if (status == GNP_OK && !decode->all && !gnp_tensors_find(tensors, "points"))
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "npz: no array named points or xyz");
	zip_discard(archive);
	return status;
}

/* The bytes of an entry, where it is a report. */
static gnp_status read_report(zip_t *archive, zip_uint64_t index, struct gnp_buffer *json, struct gnp_error *error)
{
	const struct gnp_decode all = {.all = true};
	unsigned char *head = gnp_array_new(HEADER_MAX, 1), *data = NULL;
	zip_stat_t entry;
	struct gnp_npy npy;
	zip_file_t *file = zip_stat_index(archive, index, 0, &entry) == 0 ? zip_fopen_index(archive, index, 0) : NULL;
	gnp_status status = head ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY, "npz: no memory for a header");
	if (status == GNP_OK)
		status = file ? check_entry(&entry, error)
		         : gnp_error_set(error, status_of(zip_get_error(archive)), "npz: %s", zip_strerror(archive));
	if (status == GNP_OK)
		status = read_header(file, head, &npy, error);
	if (status == GNP_OK && is_report(GNP_PARAMETERS_NAME, &npy)) {
		status = check_array(&npy, &entry, GNP_PARAMETERS_NAME, &all, error);
		if (status == GNP_OK)
			status = inflate_array(file, &entry, npy.bytes, NULL, &data, error);
		if (status == GNP_OK)
			*json = (struct gnp_buffer){data, npy.bytes, npy.bytes};
	}
	if (file)
		zip_fclose(file);
	free(head);
	return status;
}

/* The bytes of the array `parameters` of an answer; none where there is no such array. */
static gnp_status read_json(const unsigned char *body, size_t size, struct gnp_buffer *json, struct gnp_error *error)
{
	zip_source_t *source;
	zip_t *archive;
	gnp_status status = open_memory(body, size, ZIP_RDONLY, &source, &archive, error);
	if (status != GNP_OK)
		return status;
	zip_int64_t index = zip_name_locate(archive, GNP_PARAMETERS_NAME ".npy", 0);
	if (index >= 0)
		status = read_report(archive, (zip_uint64_t)index, json, error);
	zip_discard(archive);
	return status;
}

/* A stored entry with a fixed date, so that the same arrays give the same bytes. */
static bool add_entry(zip_t *archive, const char *tensor, const struct gnp_buffer *file)
{
	enum { DATE_1980_01_01 = 33 };
	char name[GNP_TENSOR_NAME_MAX + 8];
	strcat(strcpy(name, tensor), ".npy");
	zip_source_t *source = zip_source_buffer(archive, file->data, file->size, 0);
	if (!source)
		return false;
	zip_int64_t index = zip_file_add(archive, name, source, ZIP_FL_ENC_UTF_8);
	if (index < 0) {
		zip_source_free(source);
		return false;
	}
	return zip_set_file_compression(archive, (zip_uint64_t)index, ZIP_CM_STORE, 0) == 0 &&
	       zip_file_set_dostime(archive, (zip_uint64_t)index, 0, DATE_1980_01_01, 0) == 0;
}

static gnp_status copy_source(zip_source_t *source, struct gnp_buffer *buffer, struct gnp_error *error)
{
	zip_stat_t stat;
	if (zip_source_stat(source, &stat) != 0 || zip_source_open(source) != 0)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "npz: the archive cannot be read back");
	gnp_status status = gnp_buffer_reserve(buffer, stat.size, error);
	zip_int64_t got = status == GNP_OK ? zip_source_read(source, buffer->data + buffer->size, stat.size) : 0;
	zip_source_close(source);
	if (status == GNP_OK && (got < 0 || (zip_uint64_t)got != stat.size))
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "npz: the archive cannot be read back");
	if (status == GNP_OK)
		buffer->size += (size_t)got;
	return status;
}

static gnp_status make_files(const struct gnp_tensors *tensors, struct gnp_buffer *files, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < tensors->count && status == GNP_OK; i++) {
		status = gnp_npy_write_header(&tensors->items[i], &files[i], error);
		if (status == GNP_OK)
			status = gnp_buffer_append(&files[i], tensors->items[i].data, tensors->items[i].size, error);
	}
	return status;
}

/* The array of what the answer says of itself. */
static gnp_status make_report(const struct gnp_values *comments, struct gnp_buffer *file, struct gnp_error *error)
{
	struct gnp_buffer json = {0};
	gnp_status status = gnp_parameters_write(comments, &json, error);
	struct gnp_tensor tensor = {.datatype = GNP_UINT8, .rank = 1, .shape = {json.size}, .data = json.data,
	                            .size = json.size};
	if (status == GNP_OK)
		status = gnp_npy_write_header(&tensor, file, error);
	if (status == GNP_OK)
		status = gnp_buffer_append(file, json.data, json.size, error);
	gnp_buffer_clear(&json);
	return status;
}

/* files: of the tensors, and one of the report and one of a matrix's kind, empty where there is none. */
static gnp_status pack(const struct gnp_tensors *tensors, const struct gnp_buffer *files,
                       const struct gnp_buffer *comment, struct gnp_buffer *buffer, struct gnp_error *error)
{
	zip_source_t *source;
	zip_t *archive;
	gnp_status status = open_memory(NULL, 0, ZIP_TRUNCATE, &source, &archive, error);
	if (status != GNP_OK)
		return status;
	bool made = true;
	for (size_t i = 0; i < tensors->count && made; i++)
		made = add_entry(archive, tensors->items[i].name, &files[i]);
	static const char *const beside[] = {GNP_PARAMETERS_NAME, "format"};
	for (size_t i = 0; i < 2 && made; i++)
		if (files[tensors->count + i].size)
			made = add_entry(archive, beside[i], &files[tensors->count + i]);
	if (made && comment->size && comment->size <= 65535)
		made = zip_set_archive_comment(archive, (const char *)comment->data, (zip_uint16_t)comment->size) == 0;
	zip_source_keep(source); /* closing the archive drops its own reference */
	if (made && zip_close(archive) == 0) {
		status = copy_source(source, buffer, error);
	} else {
		if (status_of(zip_get_error(archive)) == GNP_OUT_OF_MEMORY)
			status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "npz: no memory for an archive of %zu arrays",
			                       tensors->count);
		else
			status = gnp_error_set(error, GNP_NOT_ACCEPTABLE, "npz: %s", zip_strerror(archive));
		zip_discard(archive);
	}
	zip_source_free(source);
	return status;
}

/* scipy's name for a matrix by rows, as an array of one text of three bytes. */
static gnp_status make_kind(struct gnp_buffer *file, struct gnp_error *error)
{
	static const char header[] = "\x93NUMPY\x01\x00\x76\x00{'descr': '|S3', 'fortran_order': False, 'shape': (), }";
	gnp_status status = gnp_buffer_append(file, header, sizeof header - 1, error);
	return status == GNP_OK ? gnp_buffer_printf(file, error, "%*s\ncsr", (int)(127 - (sizeof header - 1)), "") : status;
}

static gnp_status encode_arrays(const struct gnp_tensors *tensors, bool sparse, const struct gnp_values *comments,
                                struct gnp_buffer *buffer, struct gnp_error *error)
{
	enum { REPORT, KIND, BESIDE };
	struct gnp_buffer *files = gnp_array_zero(tensors->count + BESIDE, sizeof *files), comment = {0},
	                           *beside = files + tensors->count;
	if (!files)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "npz: no memory for %zu arrays", tensors->count);
	gnp_status status = make_files(tensors, files, error);
	if (status == GNP_OK && comments && comments->count)
		status = make_report(comments, &beside[REPORT], error);
	if (status == GNP_OK && sparse)
		status = make_kind(&beside[KIND], error);
	if (status == GNP_OK)
		status = gnp_comments_write(comments, "", &comment, error);
	if (status == GNP_OK)
		status = pack(tensors, files, &comment, buffer, error);
	for (size_t i = 0; i < tensors->count + BESIDE; i++)
		gnp_buffer_clear(&files[i]);
	free(files);
	gnp_buffer_clear(&comment);
	return status;
}

static gnp_status encode_file(const struct gnp_tensors *tensors, const struct gnp_values *comments,
                              struct gnp_buffer *buffer, struct gnp_error *error)
{
	struct gnp_tensors renamed = {0};
	bool sparse = gnp_sparse_is_symmetric(tensors);
	gnp_status status = sparse ? gnp_sparse_for_scipy(tensors, &renamed, error) : GNP_OK;
	if (status == GNP_OK)
		status = encode_arrays(sparse ? &renamed : tensors, sparse, comments, buffer, error);
	gnp_tensors_clear(&renamed);
	return status;
}

static gnp_status parameters(const unsigned char *body, size_t size, struct gnp_values *values, struct gnp_error *error)
{
	struct gnp_buffer json = {0};
	gnp_status status = read_json(body, size, &json, error);
	if (status == GNP_OK && json.size)
		status = gnp_parameters_read((const char *)json.data, json.size, values, error);
	gnp_buffer_clear(&json);
	return status;
}

static const char *const magic[] = {"PK\x03\x04", "PK\x05\x06", NULL};
static const char *const other_media_types[] = {"application/npz", "application/zip", NULL};

const struct gnp_format gnp_format_npz = {
	.name = "npz", .media_type = "application/x-npz", .extension = "npz", .other_media_types = other_media_types,
	.holds = GNP_HOLDS_TENSORS, .magic = magic, .decode = decode_file, .encode = encode_file, .parameters = parameters};
