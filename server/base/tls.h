/* The certificate in use and its private key, by GnuTLS: loaded, checked against each other, swapped while connections
 * live.
 *
 * A connection keeps the pair it began with. http.c hands the pair to the library's handshake and is the only other
 * file that knows GnuTLS's header. */
#ifndef GNPD_TLS_H
#define GNPD_TLS_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"

/* TLS 1.3 and 1.2, forward secrecy only, no SHA-1, the server's order. */
#define GNPD_TLS_PRIORITIES "SECURE128:-VERS-ALL:+VERS-TLS1.3:+VERS-TLS1.2:-RSA:-SHA1:%SERVER_PRECEDENCE"

struct gnpd_log;
struct gnpd_tls;
struct gnpd_tls_pair;

/* PEM files; the private key's must be private (secret.h). GNP_IO or GNP_INVALID_ARGUMENT name the file and the fault: unreadable,
 * not PEM, a key that is not the certificate's. On failure nothing is left. */
gnp_status gnpd_tls_create(const char *certificate, const char *key, struct gnpd_tls **out, struct gnp_error *error);
/* NULL is allowed. No pair may be held any more. */
void gnpd_tls_free(struct gnpd_tls *tls);
/* Loads both again. On failure the pair in use stays. */
gnp_status gnpd_tls_reload(struct gnpd_tls *tls, struct gnp_error *error);

/* When the certificate in use ends, in seconds since the epoch. */
double gnpd_tls_expiry(struct gnpd_tls *tls);

/* A warning when the certificate in use has ended or has not begun: clients refuse it. */
void gnpd_tls_warn(struct gnpd_tls *tls, struct gnpd_log *log);

/* The pair in use, for gnpd_tls_pair_release, which allows NULL. */
struct gnpd_tls_pair *gnpd_tls_pair(struct gnpd_tls *tls);
void gnpd_tls_pair_release(struct gnpd_tls_pair *pair);

struct gnutls_pcert_st;
struct gnutls_privkey_st;
/* What the handshake wants: *count certificates, and the key. They live as long as the pair. */
void gnpd_tls_pair_contents(struct gnpd_tls_pair *pair, struct gnutls_pcert_st **certificates, unsigned *count,
                            struct gnutls_privkey_st **key);

/* Writes last words to a session (gnutls_session_t) and says that it ends. Only on the thread that serves the connection. */
void gnpd_tls_send_last(void *session, const void *data, size_t size);

#endif
