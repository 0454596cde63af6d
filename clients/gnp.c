/* gnp: the command line. Each subcommand is a row of a table; every operation of the service is one more. */
#include <signal.h>
#include <stdio.h>
#include <string.h>

#include "clients/command.h"
#include "core/base/names.h"
#include "core/base/version.h"
#include "core/linear/blas_environment.h"
#include "core/linear/linalg.h"
#include "proto/operation/operations.h"
#include "proto/operation/usage.h"

static const struct gnp_command *const commands[] = {
	&gnp_command_sample, &gnp_command_convert, &gnp_command_compare, &gnp_command_info, &gnp_command_plot,
	&gnp_command_snapshots, &gnp_command_jobs,
};
#define COMMANDS (sizeof commands / sizeof commands[0])

static void print_exit_codes(void)
{
	puts("\nExit codes:");
#define PRINT_EXIT(id, code, text) printf("  %d  %s\n", code, text);
	GNP_EXIT_TABLE(PRINT_EXIT)
#undef PRINT_EXIT
}

static void print_help(void)
{
	puts("gnp: geometry of point clouds, here or by a gnpd server\n"
	     "\nUsage: gnp [--quiet] COMMAND [OPTIONS]    gnp COMMAND --help    gnp --version\n"
	     "\nOperations (with --local on this machine, with --url by a server):");
	const struct gnp_operation *operation;
	for (size_t i = 0; (operation = gnp_operation_at(i)); i++)
		printf("  %-10s %s\n", operation->name, operation->help);
	puts("\nFiles and clouds:");
	for (size_t i = 0; i < COMMANDS; i++)
		printf("  %-10s %s\n", commands[i]->name, commands[i]->help);
	puts("\nFormats go by the file's extension or --format: ply, npy, npz, xyz, json; also read: pcd, obj; also\n"
	     "written: vtk and mtx (of laplacian). '-' is standard input or output.");
	print_exit_codes();
}

static enum gnp_exit print_command_help(const struct gnp_command *command, struct gnp_error *error)
{
	printf("gnp %s: %s\n\nUsage: gnp %s %s\n\nOptions:\n", command->name, command->help, command->name, command->operands);
	gnp_options_print(command->options, command->option_count, stdout);
	gnp_options_print(&gnp_option_quiet, 1, stdout);
	puts("      --help                     this text");
	if (command->operation) {
		struct gnp_buffer usage = {0};
		gnp_status status = gnp_operation_usage(command->operation, &usage, error);
		if (status == GNP_OK) {
			puts("\nParameters of the operation:");
			fwrite(usage.data, 1, usage.size, stdout);
		}
		gnp_buffer_clear(&usage);
		if (status != GNP_OK)
			return GNP_EXIT_INTERNAL;
	}
	if (command->details)
		printf("\n%s\n", command->details);
	print_exit_codes();
	return GNP_EXIT_OK;
}

static enum gnp_exit run_command(const struct gnp_command *command, int argc, char **argv, struct gnp_error *error)
{
	for (int i = 0; i < argc && strcmp(argv[i], "--") != 0; i++)
		if (strcmp(argv[i], "--help") == 0)
			return print_command_help(command, error);
	struct gnp_arguments arguments;
	struct gnp_option options[GNP_OPERATION_OPTIONS_MAX + 1];
	memcpy(options, command->options, command->option_count * sizeof *options);
	options[command->option_count] = gnp_option_quiet;
	if (gnp_arguments_parse(argc, argv, options, command->option_count + 1, command->operands_most, &arguments, error) != GNP_OK)
		return GNP_EXIT_USAGE;
	if (arguments.operand_count < command->operands_least) {
		gnp_error_set(error, GNP_INVALID_ARGUMENT, "got %zu operands, need %zu: gnp %s %s", arguments.operand_count,
		              command->operands_least, command->name, command->operands);
		return GNP_EXIT_USAGE;
	}
	return command->run(command, &arguments, error);
}

static enum gnp_exit unknown_command(const char *name, struct gnp_error *error)
{
	struct gnp_names names;
	gnp_names_begin(&names, name, strlen(name));
	for (size_t i = 0; i < COMMANDS; i++)
		gnp_names_add(&names, commands[i]->name);
	for (size_t i = 0; gnp_operation_at(i); i++)
		gnp_names_add(&names, gnp_operation_at(i)->name);
	gnp_error_set(error, GNP_NOT_FOUND, "unknown command%s", gnp_names_hint(&names));
	return GNP_EXIT_USAGE;
}

static enum gnp_exit run_named(const char *name, int argc, char **argv, struct gnp_error *error)
{
	for (size_t i = 0; i < COMMANDS; i++)
		if (strcmp(commands[i]->name, name) == 0)
			return run_command(commands[i], argc, argv, error);
	const struct gnp_operation *operation = gnp_operation_find(name);
	if (!operation)
		return unknown_command(name, error);
	struct gnp_option options[GNP_OPERATION_OPTIONS_MAX];
	struct gnp_command command;
	if (gnp_command_for_operation(operation, options, &command, error) != GNP_OK)
		return GNP_EXIT_INTERNAL;
	return run_command(&command, argc, argv, error);
}

int main(int argc, char **argv)
{
	gnp_blas_environment_restart(argv);
	gnp_linalg_init();
	/* A closed pipe or connection is an error of the write, not the end of the program. */
	signal(SIGPIPE, SIG_IGN);
	if (argc > 2 && strcmp(argv[1], "--quiet") == 0) { /* a subcommand's option, wherever it stands */
		argv[1] = argv[2];
		argv[2] = "--quiet";
	}
	if (argc < 2) {
		fprintf(stderr, "gnp: no command given; 'gnp --help' lists them\n");
		return GNP_EXIT_USAGE;
	}
	if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0 || strcmp(argv[1], "help") == 0) {
		print_help();
		return GNP_EXIT_OK;
	}
	if (strcmp(argv[1], "--version") == 0) {
		puts("gnp " GNP_VERSION);
		return GNP_EXIT_OK;
	}
	struct gnp_error error = {0};
	enum gnp_exit code = run_named(argv[1], argc - 2, argv + 2, &error);
	if (code != GNP_EXIT_OK)
		fprintf(stderr, "gnp %s: %s\n", argv[1], error.text[0] ? error.text : gnp_status_text(error.status));
	if (code == GNP_EXIT_OK && fflush(stdout) != 0) {
		perror("gnp: standard output");
		code = GNP_EXIT_DATA;
	}
	if (code == GNP_EXIT_USAGE)
		fprintf(stderr, "'gnp --help' and 'gnp COMMAND --help' tell more\n");
	return code;
}
