/* The daemon that requests of the property tests are also sent to: started on a free port, and again when it died. */
#ifndef GNP_TESTS_PROPERTY_DAEMON_H
#define GNP_TESTS_PROPERTY_DAEMON_H

#include <stdbool.h>
#include <stddef.h>

/* Sees to it that a daemon runs, and writes where; program "": none is wanted. */
void daemon_watch(const char *program, const char *weights, char *url, size_t size);
/* Ends it; false when it did not end well, or had died. */
bool daemon_stop(void);

#endif
