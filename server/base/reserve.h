/* Memory that gnpd keeps back for libraries that crash when an allocation fails: with it a request that finds no
 * memory is an answer, and never the end of the daemon.
 *
 * FLANN writes through what malloc gave it without looking, and lets std::bad_alloc out of its C interface, which
 * ends the process; so does libgomp by itself, and OpenBLAS writes as FLANN does. A program that links this file
 * gets its malloc and kin: where the C library has no memory, a small piece is taken from the reserve, also for
 * one of the C library's own that is to grow. Large ones are refused as ever, and their owners answer with
 * GNP_OUT_OF_MEMORY. While half of the reserve is in use nobody enters such a library (core/base/headroom.h), so
 * that those inside can finish. FLANN's large pieces come from `new`: what it needs must have been there when it
 * was entered, and when others took it meanwhile the reserve serves that thread too. Only when that is gone too
 * `new` waits for memory, and after WAIT_SECONDS throws.
 *
 * The reserve is 64 MiB of address space until it is touched. Sanitizers have a malloc of their own: with them
 * this is headroom.h's question alone. One for the process, as there is one malloc; safe from many threads. The
 * file is linked into gnpd and its test, and stands in no archive: there it would replace malloc in whatever is
 * linked with it. */
#ifndef GNPD_RESERVE_H
#define GNPD_RESERVE_H

/* Maps the reserve and stands guard before those libraries. In main, before there are threads; later calls do
 * nothing. */
void gnpd_reserve_install(void);

#endif
