#include "core/equations/equation.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

void gnp_equation_clear(struct gnp_equation *equation)
{
	gnp_csr_clear(&equation->matrix);
	gnp_csr_clear(&equation->transpose);
	gnp_csr_clear(&equation->normal);
	free(equation->kept);
	free(equation->given);
	free(equation->pin);
	gnp_components_clear(&equation->components);
	*equation = (struct gnp_equation){.rows = 0};
}

size_t gnp_equation_bytes(const struct gnp_equation *equation)
{
	return gnp_csr_bytes(&equation->matrix) + gnp_csr_bytes(&equation->transpose) + gnp_csr_bytes(&equation->normal) +
	       equation->unknowns * (4 * sizeof(uint32_t) + 2);
}

/* Takes the collocation's Laplacian over as alpha V - Delta, and drops the rest of it. */
static void take_matrix(struct gnp_collocation *made, double alpha, struct gnp_equation *equation)
{
	double *value = made->value[GNP_DERIVATIVE_LAPLACIAN], *function = made->value[GNP_DERIVATIVE_VALUE];
	for (size_t e = 0; e < made->row_offsets[made->rows]; e++)
		value[e] = (function ? alpha * function[e] : 0) - value[e];
	equation->rows = made->rows;
	equation->unknowns = made->columns;
	equation->reduced = made->reduced;
	equation->matrix = gnp_collocation_view(made, GNP_DERIVATIVE_LAPLACIAN);
	equation->kept = made->kept;
	made->value[GNP_DERIVATIVE_LAPLACIAN] = NULL;
	made->row_offsets = NULL;
	made->column = NULL;
	made->kept = NULL;
	gnp_collocation_clear(made);
}

/* On the square system alpha u is alpha times the unknown itself rather than the fit's value there. */
static void add_alpha(struct gnp_csr *matrix, double alpha)
{
	for (size_t i = 0; i < matrix->rows && alpha != 0; i++)
		for (size_t e = matrix->row_offsets[i]; e < matrix->row_offsets[i + 1]; e++)
			if (matrix->column[e] == i)
				matrix->value[e] += alpha;
}

static double *diagonal_of(struct gnp_csr *matrix, size_t i)
{
	for (size_t e = matrix->row_offsets[i]; e < matrix->row_offsets[i + 1]; e++)
		if (matrix->column[e] == i)
			return &matrix->value[e];
	return NULL;
}

static void set_identity(struct gnp_csr *matrix, const unsigned char *given)
{
	for (size_t i = 0; given && i < matrix->rows; i++)
		for (size_t e = matrix->row_offsets[i]; given[i] && e < matrix->row_offsets[i + 1]; e++)
			matrix->value[e] = matrix->column[e] == i;
}

/* For a point that stands all alone, whose row is empty: any number of the rows' kind. */
static double largest_diagonal(struct gnp_csr *matrix)
{
	double largest = 0;
	for (size_t i = 0; i < matrix->rows; i++) {
		const double *diagonal = diagonal_of(matrix, i);
		largest = fmax(largest, diagonal ? fabs(*diagonal) : 0);
	}
	return largest > 0 ? largest : 1;
}

static gnp_status pin(struct gnp_csr *matrix, struct gnp_equation *equation, struct gnp_error *error)
{
	gnp_status status = gnp_components_find(matrix, equation->given, &equation->components, error);
	if (status != GNP_OK)
		return status;
	equation->pin = gnp_array_new(equation->components.count, sizeof *equation->pin);
	if (!equation->pin)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY,
		                     "system: no memory for %zu components", equation->components.count);
	for (size_t k = 0; k < equation->components.count; k++) {
		uint32_t anchor = equation->components.anchor[k];
		double *diagonal = diagonal_of(matrix, anchor);
		if (diagonal && *diagonal == 0 && equation->system == GNP_SYSTEM_SYMMETRIC) {
			equation->pin[k] = *diagonal = largest_diagonal(matrix);
			continue;
		}
		if (!diagonal || !(fabs(*diagonal) > 0))
			return gnp_error_set(error, GNP_SINGULAR, "system: the equation of unknown %u does not mention it", anchor);
		equation->pin[k] = *diagonal;
		*diagonal *= 2;
	}
	return GNP_OK;
}

static gnp_status finish_square(struct gnp_equation *equation, struct gnp_error *error)
{
	add_alpha(&equation->matrix, equation->alpha);
	set_identity(&equation->matrix, equation->given);
	return equation->alpha != 0 ? GNP_OK : pin(&equation->matrix, equation, error);
}

/* Nothing is asked of given points. */
static void clear_given_rows(struct gnp_equation *equation)
{
	struct gnp_csr *matrix = &equation->matrix;
	for (size_t c = 0; c < equation->unknowns; c++)
		for (size_t i = equation->kept[c], e = matrix->row_offsets[i]; equation->given[c] && e < matrix->row_offsets[i + 1]; e++)
			matrix->value[e] = 0;
}

static void clear_given_columns(const struct gnp_equation *equation, struct gnp_csr *transpose)
{
	for (size_t c = 0; c < transpose->rows; c++)
		for (size_t e = transpose->row_offsets[c]; equation->given[c] && e < transpose->row_offsets[c + 1]; e++)
			transpose->value[e] = 0;
}

static gnp_status finish_least_squares(struct gnp_pool *pool, struct gnp_task *task, struct gnp_equation *equation,
                                       struct gnp_error *error)
{
	struct gnp_csr free_part = {.rows = 0};
	if (equation->given)
		clear_given_rows(equation);
	gnp_status status = gnp_csr_transpose(&equation->matrix, &equation->transpose, error);
	if (status == GNP_OK && equation->given)
		clear_given_columns(equation, &equation->transpose);
	if (status == GNP_OK)
		status = gnp_csr_transpose(&equation->transpose, &free_part, error);
	if (status == GNP_OK)
		status = gnp_csr_product(&equation->transpose, &free_part, pool, task, &equation->normal, error);
	gnp_csr_clear(&free_part);
	if (status != GNP_OK)
		return status;
	set_identity(&equation->normal, equation->given);
	return equation->alpha != 0 ? GNP_OK : pin(&equation->normal, equation, error);
}

static gnp_status copy_given(const unsigned char *given, struct gnp_equation *equation, struct gnp_error *error)
{
	equation->given = gnp_array_new(equation->unknowns, 1);
	if (!equation->given)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "system: no memory for %zu unknowns", equation->unknowns);
	for (size_t c = 0; c < equation->unknowns; c++)
		equation->given[c] = given[equation->kept[c]] != 0;
	return GNP_OK;
}

gnp_status gnp_equation_make(const struct gnp_domain *domain, const struct gnp_laplacian_options *options, double alpha,
                             const unsigned char *given, struct gnp_pool *pool, struct gnp_task *task, struct gnp_equation *out,
                             struct gnp_error *error)
{
	struct gnp_laplacian_options wanted = *options;
	struct gnp_collocation made;
	struct gnp_equation equation = {.system = options->system, .alpha = alpha};
	bool least_squares = options->system == GNP_SYSTEM_LEAST_SQUARES;
	wanted.which = GNP_DERIVATIVE_BIT(GNP_DERIVATIVE_LAPLACIAN) |
	               (least_squares && alpha != 0 ? GNP_DERIVATIVE_BIT(GNP_DERIVATIVE_VALUE) : 0);
	gnp_status status = gnp_laplacian_assemble(domain, &wanted, given, pool, task, &made, error);
	if (status != GNP_OK)
		return status;
	take_matrix(&made, alpha, &equation);
	if (given)
		status = copy_given(given, &equation, error);
	if (status == GNP_OK)
		status = least_squares ? finish_least_squares(pool, task, &equation, error) : finish_square(&equation, error);
	if (status == GNP_OK)
		*out = equation;
	else
		gnp_equation_clear(&equation);
	return status;
}

size_t gnp_equation_part(const struct gnp_equation *equation, size_t unknown)
{
	uint32_t label = equation->components.label[unknown];
	return equation->components.count == 1 ? 0 : label == GNP_COMPONENT_NONE ? equation->components.count : label;
}
