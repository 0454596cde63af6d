/* Memory kept back for a library that cannot do without: FLANN is C++ behind a C interface that lets std::bad_alloc out, which ends the
 * process.
 *
 * When its `new` finds no memory, the reserve is given up and `new` tries again. Once that has happened, nobody enters the
 * library until the reserve is there again, so that whoever is inside finishes with what was freed. Only when the reserve is gone too
 * does `new` wait for others to free memory, and after WAIT_SECONDS the process ends.
 * What stays open: FLANN's nodes come from malloc in blocks of 8 kB, whose failure it does not look at, and its searches run in a region of
 * libgomp, which ends the process when it finds no 2 kB. Neither is entered without there having been that much just before.
 *
 * One for the process, as C++ has one handler for it; safe from many threads. */
#ifndef GNP_CORE_RESERVE_H
#define GNP_CORE_RESERVE_H

#include <stddef.h>

#include "status.h"

/* Before the library is entered: the reserve is whole, and there were `bytes`, what the call is going to take, and 64 kB at this moment.
 * GNP_OUT_OF_MEMORY otherwise. what: for the message. */
gnp_status gnp_reserve_enter(const char *what, size_t bytes, struct gnp_error *error);

#endif
