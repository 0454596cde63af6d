/* libgnp, the geometry of point clouds as a C library: the one header that a program includes.
 *
 * What the headers below declare is public and follows the version: while its first number is 0, a new second number
 * may change it, a new third one does not. All other headers and symbols are the library's own. Sources are in C11;
 * `pkg-config --cflags --libs gnp` has the flags.
 *
 * A program calls gnp_init, makes a pool of threads (core/base/pool.h), perhaps loads models (core/model/models.h),
 * fills a struct gnp_cloud with what it has, takes the default options of what it wants, and runs it:
 * gnp_estimate_run, gnp_filter_run, gnp_flow_run, gnp_smooth_run, gnp_laplacian_run, gnp_poisson_prepare and
 * gnp_poisson_solve, gnp_heat_prepare and gnp_heat_run, gnp_spectrum_run, gnp_geodesic_create and
 * gnp_geodesic_distance, gnp_geodesic_pairs, gnp_geodesic_parallel and gnp_geodesic_log.
 * clients/examples has whole programs.
 *
 * Errors: every function that can fail returns a gnp_status and writes a sentence into a struct gnp_error that the
 * caller owns (core/base/status.h). Nothing is printed, and nothing ends the process; but FLANN, which finds
 * neighbours, throws a C++ exception where memory is exhausted. Doubts: an answer that may not be believed is an
 * answer with warnings in its task (core/base/task.h, core/base/warning.h): look at them. Memory: what a function
 * gives out belongs to the caller and has a _free or _clear; what it takes is borrowed, unless its name ends in _take.
 * Threads: any number of threads may share a pool and models, each with a task of its own; the same input gives the
 * same bytes for any number of workers. */
#ifndef GNP_H
#define GNP_H

#include "core/base/pool.h"
#include "core/base/status.h"
#include "core/base/task.h"
#include "core/base/version.h"
#include "core/base/warning.h"
#include "core/cloud/cloud.h"
#include "core/geodesic/geodesic.h"
#include "core/equations/heat.h"
#include "core/equations/poisson.h"
#include "core/equations/spectrum.h"
#include "core/estimate/estimate.h"
#include "core/estimate/estimate_options.h"
#include "core/estimate/filter.h"
#include "core/fit/quantity.h"
#include "core/flow/flow.h"
#include "core/flow/flow_options.h"
#include "core/flow/flow_result.h"
#include "core/flow/smooth.h"
#include "core/model/model.h"
#include "core/model/models.h"
#include "core/operators/collocation.h"
#include "core/operators/laplacian.h"
#include "core/shapes/shapes.h"

/* Once, before anything else and before other threads begin. Keeps OpenBLAS, which the library calls from the threads of
 * its pool, to the thread that calls it: for the whole process. With OPENBLAS_NUM_THREADS=1 in the environment its
 * threads do not even begin. */
void gnp_init(void);

/* The version of the library that runs; GNP_VERSION is that of the header a program was built with. */
const char *gnp_version(void);

#endif
