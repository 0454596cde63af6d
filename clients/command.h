/* What a subcommand of gnp is: its name, its options and the function that runs it. The table of all is in gnp.c, with
 * one more for every operation that proto/ knows. */
#ifndef GNP_CLIENTS_COMMAND_H
#define GNP_CLIENTS_COMMAND_H

#include <stdbool.h>

#include "clients/options.h"
#include "core/base/status.h"
#include "proto/operation/operation.h"

/* Exit codes, as --help and the README list them. */
#define GNP_EXIT_TABLE(X)                                                                           \
	X(GNP_EXIT_OK, 0, "done")                                                                       \
	X(GNP_EXIT_DATA, 1, "the data or a file cannot be used")                                        \
	X(GNP_EXIT_USAGE, 2, "the command line is wrong")                                               \
	X(GNP_EXIT_SERVER, 3, "the server cannot be reached or cannot do the work now")                 \
	X(GNP_EXIT_CANCELLED, 4, "cancelled (Ctrl-C)")                                                  \
	X(GNP_EXIT_INTERNAL, 5, "memory is exhausted, or an internal error")

enum gnp_exit {
#define GNP_EXIT_ENUM(id, code, text) id = code,
	GNP_EXIT_TABLE(GNP_EXIT_ENUM)
#undef GNP_EXIT_ENUM
};

/* The exit code for a failure of the work itself; remote: the status came from a server. */
enum gnp_exit gnp_exit_of(gnp_status status, bool remote);

/* --quiet, which every subcommand takes. */
extern const struct gnp_option gnp_option_quiet;

struct gnp_command {
	const char *name, *operands, *help; /* operands: as the synopsis shows them ("IN -o OUT") */
	const char *details;                /* printed below the options; may be NULL */
	const struct gnp_option *options;
	size_t option_count;
	size_t operands_least, operands_most;
	/* Arguments are parsed and counted. What went wrong goes into error; main prints it. */
	enum gnp_exit (*run)(const struct gnp_command *command, const struct gnp_arguments *arguments, struct gnp_error *error);
	const struct gnp_operation *operation; /* of gnp_command_for_operation; else NULL */
};

extern const struct gnp_command gnp_command_sample, gnp_command_convert, gnp_command_compare, gnp_command_info,
	gnp_command_plot, gnp_command_snapshots, gnp_command_jobs;

/* The subcommand of an operation: its flags and help come from the operation's table. options must outlive *command. */
#define GNP_OPERATION_OPTIONS_MAX 48
gnp_status gnp_command_for_operation(const struct gnp_operation *operation,
                                     struct gnp_option options[GNP_OPERATION_OPTIONS_MAX], struct gnp_command *command,
                                     struct gnp_error *error);

#endif
