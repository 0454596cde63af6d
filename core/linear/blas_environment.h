/* Starts the program anew with the environment that OpenBLAS wants to have been told before main: for main
 * functions alone, the first thing they do.
 *
 * OpenBLAS picks its kernels by processor model before main runs, and takes a model newer than itself for an old
 * one; and unless it is told before that too to keep to one thread, threads that call it at once wait for each
 * other. No call can mend that later, and to start the program again is a thing for programs and not for a
 * library: nothing else of core/ calls this. It stands here because gnpd and the clients both need it, and what
 * both of them include is core/ and proto/, of which this is nearer. */
#ifndef GNP_CORE_BLAS_ENVIRONMENT_H
#define GNP_CORE_BLAS_ENVIRONMENT_H

/* Where the environment does not say (OPENBLAS_CORETYPE, OPENBLAS_NUM_THREADS), sets the kernels of the
 * instruction set that is there and one thread, and executes the program again with the same arguments. Returns
 * when there is nothing to do or that fails. Before there are threads, open files or output. */
void gnp_blas_environment_restart(char **argv);

#endif
