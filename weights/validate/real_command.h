/* gnp-validate --table real: from options to the table, written where they say. */
#ifndef GNP_WEIGHTS_REAL_COMMAND_H
#define GNP_WEIGHTS_REAL_COMMAND_H

#include "clients/command.h"
#include "clients/options.h"

enum gnp_exit gnp_real_command(const struct gnp_arguments *arguments, struct gnp_error *error);

#endif
