/* Asks, before a library is entered that crashes when an allocation fails, whether there is memory for what the
 * call will take.
 *
 * FLANN throws std::bad_alloc through its C interface and writes through what malloc gave it without looking, its
 * OpenMP ends the process; jansson fails an assertion. Where others take memory in the meantime the answer is a
 * forecast. A program that must outlive that puts something of its own behind the question when it starts, as gnpd
 * does (server/base/reserve.h); the library replaces nothing by itself. */
#ifndef GNP_CORE_HEADROOM_H
#define GNP_CORE_HEADROOM_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"

/* Whether there are `bytes` at this moment, found by taking and freeing them. GNP_OUT_OF_MEMORY otherwise. what:
 * for the message. Safe from many threads; allocates nothing that stays. */
gnp_status gnp_headroom_need(const char *what, size_t bytes, struct gnp_error *error);

/* Has every question answered no where may_enter() is false, and calls it in the thread that is about to enter.
 * For main functions, before there are threads; NULL: as it was. */
void gnp_headroom_install(bool (*may_enter)(void));

#endif
