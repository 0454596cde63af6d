/* Tells where a request says it goes and which page of a browser sends it, so that no page of another site uses this
 * server through its visitors' browsers.
 *
 * A page may send a form's request to any address, and its browser says so in Origin and Sec-Fetch-Site, which no page
 * can write. A page whose owner lets its name resolve to this machine (DNS rebinding) is this server's own for the
 * browser: there only the name in Host tells. Programs that are no browsers send neither Origin nor Sec-Fetch-Site,
 * and HTTP/1.0 need not have a Host. */
#ifndef GNPD_SITE_H
#define GNPD_SITE_H

#include "core/base/status.h"

struct gnpd_site {
	const char *host;   /* NAME[:PORT]: of the target's absolute form, else Host; NULL when absent */
	const char *origin; /* values of Origin and Sec-Fetch-Site; NULL when absent */
	const char *fetch;
};

/* A list of allowed-hosts: names or numeric addresses, without ports, separated by commas; "*": any name. GNP_INVALID_ARGUMENT. */
gnp_status gnpd_site_check_list(const char *allowed, struct gnp_error *error);

/* No host, a numeric address, localhost and what is under it, and those allowed pass: no rebound name can be one of them. Ports are
 * not looked at: tunnels change them. GNP_INVALID_ARGUMENT of what is no host, GNP_FORBIDDEN of other names. */
gnp_status gnpd_site_check_host(const struct gnpd_site *site, const char *allowed, struct gnp_error *error);

/* For methods that change something. What the browser says of a page of this server, Origin being Host's or of a name allowed, and what
 * comes from no browser pass. Sec-Fetch-Site decides alone where it is there: a proxy may have changed Host, but not it. GNP_FORBIDDEN. */
gnp_status gnpd_site_check_origin(const struct gnpd_site *site, const char *allowed, struct gnp_error *error);

#endif
