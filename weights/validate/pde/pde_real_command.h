/* The command line of the table of equations on real and exact surfaces: gnp-validate --table pde-real. */
#ifndef GNP_WEIGHTS_PDE_REAL_COMMAND_H
#define GNP_WEIGHTS_PDE_REAL_COMMAND_H

#include "clients/command.h"
#include "clients/options.h"

enum gnp_exit gnp_pde_real_command(const struct gnp_arguments *arguments, struct gnp_error *error);

#endif
