#include "core/gnp.h"

#include "core/linear/linalg.h"

void gnp_init(void)
{
	gnp_linalg_init();
}

const char *gnp_version(void)
{
	return GNP_VERSION;
}
