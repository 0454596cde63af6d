/* The main of programs without subcommands: options from a table, --help, one thing to run, its error and exit code. */
#ifndef GNP_CLIENTS_PROGRAM_H
#define GNP_CLIENTS_PROGRAM_H

#include "clients/command.h"

struct gnp_program {
	const char *name, *purpose; /* as --help and messages show them */
	const struct gnp_option *options;
	size_t option_count;
	/* Arguments are parsed. What went wrong goes into error, which is printed. */
	enum gnp_exit (*run)(const struct gnp_arguments *arguments, struct gnp_error *error);
};

/* The whole of main: picks the processor's kernels (gnp_blas_environment_restart), parses, runs. The exit code. */
int gnp_program_main(const struct gnp_program *program, int argc, char **argv);

#endif
