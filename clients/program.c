#include "clients/program.h"

#include "core/linear/blas_environment.h"
#include "core/linear/linalg.h"

int gnp_program_main(const struct gnp_program *program, int argc, char **argv)
{
	struct gnp_arguments arguments;
	struct gnp_error error = {0};
	enum gnp_exit code = GNP_EXIT_USAGE;
	gnp_blas_environment_restart(argv);
	if (gnp_arguments_parse(argc - 1, argv + 1, program->options, program->option_count, 0, &arguments, &error) == GNP_OK) {
		if (gnp_arguments_has(&arguments, "help")) {
			printf("%s: %s\n\nOptions:\n", program->name, program->purpose);
			gnp_options_print(program->options, program->option_count, stdout);
			return GNP_EXIT_OK;
		}
		gnp_linalg_init();
		code = program->run(&arguments, &error);
	}
	if (code != GNP_EXIT_OK)
		fprintf(stderr, "%s: %s\n", program->name, error.text[0] ? error.text : gnp_status_text(error.status));
	return code;
}
