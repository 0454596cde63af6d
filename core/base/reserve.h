/* Memory kept back for libraries that do not bear to run out of it: FLANN writes through what malloc gave it without looking, and lets
 * std::bad_alloc out of its C interface, which ends the process; so does libgomp by itself, and OpenBLAS writes as FLANN does.
 *
 * malloc and its kin are replaced (core/base/reserve.c): where the C library has no memory, a small piece is taken from the reserve, also
 * for one of the C library's own that is to grow. Large
 * ones are refused as ever, and their owners answer with GNP_OUT_OF_MEMORY. While half of the reserve is in use nobody enters FLANN, so
 * that those inside can finish. The reserve is address space until it is touched; sanitizers, which have a malloc of their own, do without.
 * FLANN's large pieces come from `new`: what it needs must have been there when it was entered, and when others took it meanwhile
 * the reserve serves that thread too. Only when that is gone too `new` waits for memory, and after WAIT_SECONDS throws.
 *
 * One for the process, as there is one malloc; safe from many threads. */
#ifndef GNP_CORE_RESERVE_H
#define GNP_CORE_RESERVE_H

#include <stddef.h>

#include "core/base/status.h"

/* Before such a library is entered: most of the reserve is whole, and there are `bytes`, what the call is going to take, at this moment.
 * GNP_OUT_OF_MEMORY otherwise. what: for the message. */
gnp_status gnp_reserve_enter(const char *what, size_t bytes, struct gnp_error *error);

#endif
