#include "clients/command.h"

const struct gnp_option gnp_option_quiet = {"quiet", 0, NULL, "no warnings on standard error"};

enum gnp_exit gnp_exit_of(gnp_status status, bool remote)
{
	switch (status) {
	case GNP_OK: return GNP_EXIT_OK;
	case GNP_CANCELLED: return GNP_EXIT_CANCELLED;
	case GNP_INVALID_ARGUMENT:
	case GNP_TOO_LARGE:
	case GNP_UNSUPPORTED_MEDIA:
	case GNP_NOT_ACCEPTABLE:
	case GNP_DEGENERATE:
	case GNP_SINGULAR:
	case GNP_NO_CONVERGENCE: return GNP_EXIT_DATA;
	case GNP_IO:
	case GNP_NOT_FOUND:
	case GNP_UNAVAILABLE: return remote ? GNP_EXIT_SERVER : GNP_EXIT_DATA;
	default: return remote ? GNP_EXIT_SERVER : GNP_EXIT_INTERNAL;
	}
}
