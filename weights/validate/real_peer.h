/* Programs of others that estimate normals (tests/peers): which there are, and how they are run on a cloud.
 *
 * A program is called as PROGRAM METHOD K[,K...] CLOUD CENTRES NORMALS: CLOUD holds points (n, 3) as doubles, CENTRES
 * the judged points as 32-bit integers; it writes NORMALS, doubles (neighbours' numbers, centres, 3), NaN where it has
 * none, and prints the seconds of its work. Everything is little-endian, without headers. */
#ifndef GNP_WEIGHTS_REAL_PEER_H
#define GNP_WEIGHTS_REAL_PEER_H

#include <stdbool.h>

#include "weights/validate/real_cloud.h"
#include "weights/validate/temporary.h"

struct gnp_real_peer {
	const char *name;    /* of its column */
	const char *program; /* in the folder of the peers */
	const char *method;
};

/* NULL past the last. */
const struct gnp_real_peer *gnp_real_peer_at(size_t i);

/* Where they are, and where they and we meet. */
struct gnp_real_peers {
	char folder[512];                 /* "": there are none */
	char meeting[GNP_TEMPORARY_PATH]; /* a temporary folder */
	size_t centres;                   /* of the cloud given last */
};

/* folder may be NULL. GNP_IO. Closed by gnp_real_peers_close, which removes the temporary files. */
gnp_status gnp_real_peers_open(const char *folder, struct gnp_real_peers *peers, struct gnp_error *error);
void gnp_real_peers_close(struct gnp_real_peers *peers);

/* Whether the program is there and may be run. peers may be NULL. */
bool gnp_real_peers_have(const struct gnp_real_peers *peers, const struct gnp_real_peer *peer);

/* Hands a cloud over, for all runs until the next one. */
gnp_status gnp_real_peers_give(struct gnp_real_peers *peers, const struct gnp_real_cloud *cloud,
                               struct gnp_error *error);

/* normals (count, centres, 3) out; *seconds grows by what the program says. GNP_UNAVAILABLE: it could not be run or did
 * not do its work. */
gnp_status gnp_real_peers_run(const struct gnp_real_peers *peers, const struct gnp_real_peer *peer, const unsigned *k,
                              size_t count, double *normals, double *seconds, struct gnp_error *error);

#endif
