/* What one file format is: its names and media types, how it is recognised, and the functions that read and write
 * it.
 *
 * Each format is defined in a file of its own; proto/file/formats.c holds the table of all. What formats share is in
 * proto/codec. */
#ifndef GNP_PROTO_FORMAT_H
#define GNP_PROTO_FORMAT_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"
#include "proto/codec/decode.h"
#include "proto/tensor/message.h"
#include "proto/tensor/tensor.h"

/* What a file can hold. */
enum gnp_format_holds {
	GNP_HOLDS_TENSORS, /* any */
	GNP_HOLDS_ROWS,    /* all with as many rows as the points have */
	GNP_HOLDS_ARRAY,   /* one beside the points */
	GNP_HOLDS_MATRIX   /* a sparse matrix */
};

struct gnp_format {
	const char *name;                     /* as in ?format= */
	const char *media_type, *extension;
	const char *const *other_names;       /* further names and extensions in use, NULL-terminated; NULL: none */
	const char *const *other_media_types; /* likewise; an answer has the one that was asked for */
	const char *const *body_media_types;  /* likewise, of bodies alone: no answer has them */
	enum gnp_format_holds holds;
	const char *const *magic;             /* what files begin with, NULL-terminated; NULL: nothing of the kind */
	/* Whether a text begins as files do; past blanks and comments with #. Formats are asked where no magic fits, and
	 * at most one says yes. NULL: never. */
	bool (*begins)(const char *text, const char *end);
	/* Appends to *tensors, which may hold part of the file after a failure. NULL: it cannot be read. */
	gnp_status (*decode)(const struct gnp_decode *decode, struct gnp_tensors *tensors, struct gnp_error *error);
	/* Appends to *buffer, which may hold part of the file after a failure. comments may be NULL. NULL: it cannot be
	 * written. */
	gnp_status (*encode)(const struct gnp_tensors *tensors, const struct gnp_values *comments,
	                     struct gnp_buffer *buffer, struct gnp_error *error);
	/* Adds what a file says of itself. NULL: there is no place for it. */
	gnp_status (*parameters)(const unsigned char *body, size_t size, struct gnp_values *values,
	                         struct gnp_error *error);
};

/* Those that code speaks of by name; a new one need not stand here. */
extern const struct gnp_format gnp_format_ply, gnp_format_npy, gnp_format_npz, gnp_format_xyz, gnp_format_csv,
	gnp_format_pcd, gnp_format_obj, gnp_format_vtk, gnp_format_mtx, gnp_format_json;

/* Of NULL, which is no format: "unknown", application/octet-stream and false. */
const char *gnp_format_name(const struct gnp_format *format);
const char *gnp_format_media_type(const struct gnp_format *format);
bool gnp_format_readable(const struct gnp_format *format);
bool gnp_format_writable(const struct gnp_format *format);
bool gnp_format_of_rows(const struct gnp_format *format);

/* Whether a text begins with a word: for `begins`. */
bool gnp_format_begins(const char *text, const char *end, const char *word);

/* The media type of bytes of any kind. */
extern const char gnp_format_generic_media_type[];

#endif
