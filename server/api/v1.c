#include "server/api/v1.h"

gnp_status gnpd_v1_operation(struct gnpd_request *request, struct gnp_error *error)
{
	return gnpd_work_run(&request->work, error);
}
