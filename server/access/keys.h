/* Reads the file of keys, and finds the key that a request brings.
 *
 * A line is a name, the SHA-256 of its keys, and what they allow; '#' begins a comment, empty lines are skipped:
 *
 *   alice  sha256:<64 hex digits>[,sha256:...]  infer,jobs  [concurrency=N] [rate=N/s|/m|/h] [burst=N]
 *
 * Several hashes are for changing a key: the old and the new one name the same caller meanwhile. Keys themselves are
 * never stored: they are random (gnpd --make-key), so that a plain hash does not give them away. */
#ifndef GNPD_KEYS_H
#define GNPD_KEYS_H

#include <stddef.h>

#include "core/base/sha256.h"
#include "core/base/status.h"
#include "server/access/scope.h"

enum {
	GNPD_KEY_NAME_MAX = 64, /* characters of [A-Za-z0-9._-] */
	GNPD_KEY_SECRET_MAX = 512,
	GNPD_KEYS_MAX = 4096,   /* hashes of a file */
	GNPD_KEYS_FILE_MAX = 1 << 20,
	GNPD_KEY_TEXT = 70,     /* a made key: "gnpd_", 64 hexadecimal digits and the NUL */
	GNPD_KEY_NONE = -1
};

struct gnpd_key {
	char name[GNPD_KEY_NAME_MAX + 1];
	unsigned scopes;    /* bit 1 << enum gnpd_scope */
	size_t concurrency; /* requests under way; 0: any number */
	double rate, burst; /* requests a second, and at once; rate 0: any */
};

struct gnpd_key_hash {
	unsigned char digest[GNP_SHA256_SIZE];
	size_t key; /* index into items */
};

struct gnpd_keys {
	size_t count, hash_count;
	struct gnpd_key *items;
	struct gnpd_key_hash *hashes;
};

/* data need not end in a NUL and may hold anything. GNP_INVALID_ARGUMENT names the line. On failure *out is unchanged. */
gnp_status gnpd_keys_parse(const char *data, size_t size, struct gnpd_keys **out, struct gnp_error *error);
/* The file of keys-file, which must be private. */
gnp_status gnpd_keys_load(const char *path, struct gnpd_keys **out, struct gnp_error *error);
/* NULL is allowed. */
void gnpd_keys_free(struct gnpd_keys *keys);

/* The index of the key whose hash a secret has, or GNPD_KEY_NONE. The time depends on the number of hashes alone. */
long gnpd_keys_find(const struct gnpd_keys *keys, const char *secret);

/* "infer" and so on; NULL for GNPD_SCOPE_NONE. */
const char *gnpd_scope_name(enum gnpd_scope scope);

/* What a request says of who sends it. */
struct gnpd_credentials {
	const char *authorization, *api_key; /* values of Authorization and X-API-Key; NULL when absent */
	unsigned authorizations, api_keys;   /* how often they came */
};

/* The key in "Authorization: Bearer KEY" or in "X-API-Key: KEY", borrowed. GNP_UNAUTHORIZED for none, for two that differ, and
 * for what is not of this form; texts never hold what was sent. */
gnp_status gnpd_credentials_secret(const struct gnpd_credentials *credentials, const char **secret, struct gnp_error *error);

/* A fresh key of 256 random bits, and the digits of its hash. */
gnp_status gnpd_key_make(char key[GNPD_KEY_TEXT], char hash[GNP_SHA256_TEXT], struct gnp_error *error);
/* GNP_INVALID_ARGUMENT when a name has other characters or another length than a file may hold. */
gnp_status gnpd_key_check_name(const char *name, struct gnp_error *error);

#endif
