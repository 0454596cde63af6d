#include "proto/tensor/budget.h"

gnp_status gnp_budget_reserve(const struct gnp_budget *budget, size_t bytes, struct gnp_error *error)
{
	return budget ? budget->reserve(budget->context, bytes, error) : GNP_OK;
}

void gnp_budget_release(const struct gnp_budget *budget, size_t bytes)
{
	if (budget)
		budget->release(budget->context, bytes);
}
