#include "server/base/tls.h"

#include <gnutls/abstract.h>
#include <gnutls/gnutls.h>
#include <gnutls/x509.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "server/base/log.h"
#include "server/base/secret.h"

enum { CHAIN_MAX = 16, FILE_MAX = 1 << 20 };

struct gnpd_tls_pair {
	atomic_size_t references;
	gnutls_pcert_st certificates[CHAIN_MAX];
	unsigned count;
	gnutls_privkey_t key;
	time_t begin, expiry;
};

struct gnpd_tls {
	char *certificate_path, *key_path;
	pthread_mutex_t lock; /* of current */
	struct gnpd_tls_pair *current;
};

void gnpd_tls_pair_release(struct gnpd_tls_pair *pair)
{
	if (!pair || atomic_fetch_sub(&pair->references, 1) > 1)
		return;
	for (unsigned i = 0; i < pair->count; i++)
		gnutls_pcert_deinit(&pair->certificates[i]);
	if (pair->key)
		gnutls_privkey_deinit(pair->key);
	free(pair);
}

static gnp_status fail(struct gnp_error *error, const char *what, const char *path, int code)
{
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: %s: %s", what, path, gnutls_strerror(code));
}

static gnp_status read_validity(struct gnpd_tls_pair *pair, const char *path, const gnutls_datum_t *text, struct gnp_error *error)
{
	gnutls_x509_crt_t first;
	int code = gnutls_x509_crt_init(&first);
	if (code < 0)
		return fail(error, "tls-certificate", path, code);
	code = gnutls_x509_crt_import(first, text, GNUTLS_X509_FMT_PEM);
	if (code >= 0) {
		pair->begin = gnutls_x509_crt_get_activation_time(first);
		pair->expiry = gnutls_x509_crt_get_expiration_time(first);
	}
	gnutls_x509_crt_deinit(first);
	return code < 0 ? fail(error, "tls-certificate", path, code) : GNP_OK;
}

static gnp_status import_certificates(struct gnpd_tls_pair *pair, const char *path, const gnutls_datum_t *text, struct gnp_error *error)
{
	unsigned count = CHAIN_MAX;
	int code = gnutls_pcert_list_import_x509_raw(pair->certificates, &count, text, GNUTLS_X509_FMT_PEM,
	                                             GNUTLS_X509_CRT_LIST_IMPORT_FAIL_IF_EXCEED);
	if (code < 0)
		return fail(error, "tls-certificate", path, code);
	pair->count = count;
	return read_validity(pair, path, text, error);
}

static gnp_status import_key(struct gnpd_tls_pair *pair, const char *path, const gnutls_datum_t *text, struct gnp_error *error)
{
	int code = gnutls_privkey_init(&pair->key);
	if (code >= 0)
		code = gnutls_privkey_import_x509_raw(pair->key, text, GNUTLS_X509_FMT_PEM, NULL, 0);
	return code < 0 ? fail(error, "tls-key", path, code) : GNP_OK;
}

static gnp_status check_match(const struct gnpd_tls *tls, const gnutls_datum_t *certificate, const gnutls_datum_t *key,
                              struct gnp_error *error)
{
	gnutls_certificate_credentials_t credentials;
	int code = gnutls_certificate_allocate_credentials(&credentials);
	if (code < 0)
		return fail(error, "tls-key", tls->key_path, code);
	code = gnutls_certificate_set_x509_key_mem(credentials, certificate, key, GNUTLS_X509_FMT_PEM);
	gnutls_certificate_free_credentials(credentials);
	if (code == GNUTLS_E_CERTIFICATE_KEY_MISMATCH)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tls-key: %s: is not the key of the certificate %s", tls->key_path,
		                     tls->certificate_path);
	return code < 0 ? fail(error, "tls-key", tls->key_path, code) : GNP_OK;
}

static gnp_status make_pair(const struct gnpd_tls *tls, const gnutls_datum_t *certificate, const gnutls_datum_t *key,
                            struct gnpd_tls_pair **out, struct gnp_error *error)
{
	struct gnpd_tls_pair *pair = calloc(1, sizeof *pair);
	if (!pair)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "tls: no memory");
	atomic_init(&pair->references, 1);
	gnp_status status = import_certificates(pair, tls->certificate_path, certificate, error);
	if (status == GNP_OK)
		status = import_key(pair, tls->key_path, key, error);
	if (status == GNP_OK)
		status = check_match(tls, certificate, key, error);
	if (status == GNP_OK)
		*out = pair;
	else
		gnpd_tls_pair_release(pair);
	return status;
}

static gnp_status load(const struct gnpd_tls *tls, struct gnpd_tls_pair **out, struct gnp_error *error)
{
	char *certificate = NULL, *key = NULL;
	size_t certificate_size = 0, key_size = 0;
	gnp_status status = gnpd_secret_read("tls-certificate", tls->certificate_path, false, FILE_MAX, &certificate,
	                                     &certificate_size, error);
	if (status == GNP_OK)
		status = gnpd_secret_read("tls-key", tls->key_path, true, FILE_MAX, &key, &key_size, error);
	if (status == GNP_OK)
		status = make_pair(tls, &(gnutls_datum_t){(unsigned char *)certificate, (unsigned)certificate_size},
		                   &(gnutls_datum_t){(unsigned char *)key, (unsigned)key_size}, out, error);
	if (key)
		explicit_bzero(key, key_size);
	free(certificate);
	free(key);
	return status;
}

gnp_status gnpd_tls_reload(struct gnpd_tls *tls, struct gnp_error *error)
{
	struct gnpd_tls_pair *pair = NULL, *before;
	gnp_status status = load(tls, &pair, error);
	if (status != GNP_OK)
		return status;
	pthread_mutex_lock(&tls->lock);
	before = tls->current;
	tls->current = pair;
	pthread_mutex_unlock(&tls->lock);
	gnpd_tls_pair_release(before);
	return GNP_OK;
}

gnp_status gnpd_tls_create(const char *certificate, const char *key, struct gnpd_tls **out, struct gnp_error *error)
{
	struct gnpd_tls *tls = calloc(1, sizeof *tls);
	if (!tls)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "tls: no memory");
	pthread_mutex_init(&tls->lock, NULL);
	tls->certificate_path = strdup(certificate);
	tls->key_path = strdup(key);
	gnp_status status = tls->certificate_path && tls->key_path ? gnpd_tls_reload(tls, error)
	                                                           : gnp_error_set(error, GNP_OUT_OF_MEMORY, "tls: no memory");
	if (status == GNP_OK)
		*out = tls;
	else
		gnpd_tls_free(tls);
	return status;
}

void gnpd_tls_free(struct gnpd_tls *tls)
{
	if (!tls)
		return;
	gnpd_tls_pair_release(tls->current);
	pthread_mutex_destroy(&tls->lock);
	free(tls->certificate_path);
	free(tls->key_path);
	free(tls);
}

struct gnpd_tls_pair *gnpd_tls_pair(struct gnpd_tls *tls)
{
	pthread_mutex_lock(&tls->lock);
	struct gnpd_tls_pair *pair = tls->current;
	atomic_fetch_add(&pair->references, 1);
	pthread_mutex_unlock(&tls->lock);
	return pair;
}

double gnpd_tls_expiry(struct gnpd_tls *tls)
{
	struct gnpd_tls_pair *pair = gnpd_tls_pair(tls);
	double expiry = (double)pair->expiry;
	gnpd_tls_pair_release(pair);
	return expiry;
}

void gnpd_tls_warn(struct gnpd_tls *tls, struct gnpd_log *log)
{
	struct gnpd_tls_pair *pair = gnpd_tls_pair(tls);
	time_t now = time(NULL), when = now < pair->begin ? pair->begin : pair->expiry;
	struct tm utc;
	char text[32];
	if (now < pair->begin || now >= pair->expiry) {
		gmtime_r(&when, &utc);
		strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
		gnpd_log_event(log, GNPD_LOG_WARNING, "tls-certificate: %s: %s %s, clients will refuse it", tls->certificate_path,
		               now < pair->begin ? "is not valid before" : "expired at", text);
	}
	gnpd_tls_pair_release(pair);
}

void gnpd_tls_pair_contents(struct gnpd_tls_pair *pair, struct gnutls_pcert_st **certificates, unsigned *count,
                            struct gnutls_privkey_st **key)
{
	*certificates = pair->certificates;
	*count = pair->count;
	*key = pair->key;
}

void gnpd_tls_send_last(void *session, const void *data, size_t size)
{
	/* What does not fit the socket's buffer is lost: nobody waits for a client that is being cut off. */
	if (gnutls_record_send(session, data, size) == (ssize_t)size)
		gnutls_bye(session, GNUTLS_SHUT_WR);
}
