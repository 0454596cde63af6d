#include "weights/validate/selection.h"

struct gnp_selection gnp_selection_all(void)
{
	struct gnp_selection selection = {.families = (1u << GNP_FAMILIES) - 1, .regimes = (1u << GNP_REGIMES) - 1};
	gnp_selection_take(&selection, (1u << GNP_METHODS) - 1);
	return selection;
}

void gnp_selection_take(struct gnp_selection *selection, unsigned methods)
{
	for (int r = 0; r < GNP_REGIMES; r++)
		selection->methods[r] = methods;
}

size_t gnp_row_number(const struct gnp_row *row)
{
	return ((size_t)row->family * GNP_REGIMES + row->regime) * GNP_METHODS + row->method;
}

static struct gnp_row row_at(size_t number)
{
	return (struct gnp_row){(enum gnp_family)(number / GNP_METHODS / GNP_REGIMES),
	                        (enum gnp_regime)(number / GNP_METHODS % GNP_REGIMES),
	                        (enum gnp_method)(number % GNP_METHODS)};
}

bool gnp_selection_has(const struct gnp_selection *selection, const struct gnp_row *row)
{
	return selection->families >> row->family & selection->regimes >> row->regime &
	       selection->methods[row->regime] >> row->method & 1;
}

bool gnp_selection_next(const struct gnp_selection *selection, const struct gnp_row *row, struct gnp_row *next)
{
	for (size_t number = row ? gnp_row_number(row) + 1 : 0; number < GNP_ROWS; number++) {
		const struct gnp_row candidate = row_at(number);
		if (gnp_selection_has(selection, &candidate)) {
			*next = candidate;
			return true;
		}
	}
	return false;
}

size_t gnp_selection_count(const struct gnp_selection *selection)
{
	struct gnp_row row;
	size_t count = 0;
	for (bool more = gnp_selection_next(selection, NULL, &row); more; more = gnp_selection_next(selection, &row, &row))
		count++;
	return count;
}

gnp_status gnp_selection_check(const struct gnp_selection *selection, const struct gnp_models *models, struct gnp_error *error)
{
	struct gnp_row row;
	const struct gnp_model *model;
	gnp_status status = GNP_OK;
	for (bool more = gnp_selection_next(selection, NULL, &row); more && status == GNP_OK;
	     more = gnp_selection_next(selection, &row, &row))
		status = gnp_method_model(row.method, row.regime, models, &model, error);
	return status;
}

void gnp_selection_restrict(struct gnp_selection *selection, const struct gnp_models *models)
{
	const struct gnp_model *model;
	for (int r = 0; r < GNP_REGIMES; r++)
		for (int c = 0; c < GNP_METHODS; c++)
			if (gnp_method_model((enum gnp_method)c, (enum gnp_regime)r, models, &model, NULL) != GNP_OK)
				selection->methods[r] &= ~(1u << c);
}
