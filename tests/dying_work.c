/* Work that ends the process or never ends, for tests of what is left of it: linked in place of the daemon's own (--wrap) into
 * tests/dying_gnpd alone. Which work does what is told by its number of points; all other work is done as ever. */
#include <stdlib.h>
#include <unistd.h>

#include "server/work/work.h"

enum { DIES = 61, HANGS = 62 };

gnp_status __real_gnpd_work_finish(struct gnpd_work *work, struct gnp_error *error);
gnp_status __wrap_gnpd_work_finish(struct gnpd_work *work, struct gnp_error *error);
gnp_status __wrap_gnpd_work_run(struct gnpd_work *work, struct gnp_error *error);

gnp_status __wrap_gnpd_work_finish(struct gnpd_work *work, struct gnp_error *error)
{
	if (work->call.points == DIES)
		abort();
	while (work->call.points == HANGS) /* whoever asks for its end is not heard */
		pause();
	return __real_gnpd_work_finish(work, error);
}

gnp_status __wrap_gnpd_work_run(struct gnpd_work *work, struct gnp_error *error)
{
	gnp_status status = gnpd_work_prepare(work, error);
	return status == GNP_OK ? __wrap_gnpd_work_finish(work, error) : status;
}
