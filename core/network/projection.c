#include "core/network/projection.h"

#include <math.h>
#include <string.h>

#include "core/base/scratch.h"
#include "core/fit/least_squares.h"

enum { ORDERS = GNP_TAYLOR_DEGREE + 1, SIZE = GNP_TAYLOR_SIZE, STRIDE = GNP_TAYLOR_STRIDE };

static const double RIDGE_SLOPE = 4, SHELL_SLOPE = 2, RIDGE_LOG_MAX = 60;
static const double SMALLEST = 1e-15; /* pivot; and the share by which a diagonal is lifted at first */

bool gnp_projection_work_take(const struct gnp_architecture *architecture, struct gnp_projection_work *work,
                              struct gnp_scratch *scratch)
{
	size_t points = architecture->shell[architecture->shells - 1];
	*work = (struct gnp_projection_work){.u = gnp_scratch_take(scratch, points, sizeof(double)),
	                                     .v = gnp_scratch_take(scratch, points, sizeof(double)),
	                                     .y = gnp_scratch_take(scratch, points, sizeof(double)),
	                                     .ones = gnp_scratch_take(scratch, points, sizeof(double)),
	                                     .rows = gnp_scratch_take(scratch, points, STRIDE * sizeof(double))};
	if (!work->u || !work->v || !work->y || !work->ones || !work->rows)
		return false;
	for (size_t i = 0; i < points; i++)
		work->ones[i] = 1;
	return true;
}

static void gather_shell(struct gnp_projection *out, unsigned l, const struct gnp_projection_work *work, size_t from,
                         size_t to)
{
	_Alignas(64) double gram[STRIDE * STRIDE];
	out->count[l] = to - from;
	gnp_taylor_rows(GNP_TAYLOR_DEGREE, work->u + from, work->v + from, to - from, STRIDE, work->rows);
	gnp_normal_equations(work->rows, work->ones, work->y + from, to - from, STRIDE, gram, out->moment[l]);
	memcpy(out->gram[l], gram, sizeof out->gram[l]);
	for (size_t i = from; i < to; i++)
		out->square[l] += work->y[i] * work->y[i];
}

void gnp_projection_gather(const struct gnp_architecture *architecture, const struct gnp_patch *patch,
                           const uint32_t *usable, size_t count, struct gnp_projection_work *work,
                           struct gnp_projection *out)
{
	double height = patch->scale_w / patch->scale_xy;
	size_t most = architecture->shell[architecture->shells - 1], from = 0;
	count = count < most ? count : most;
	for (size_t i = 0; i < count; i++) {
		work->u[i] = patch->u[usable[i]];
		work->v[i] = patch->v[usable[i]];
		work->y[i] = patch->w[usable[i]] * height;
	}
	out->shells = architecture->shells;
	for (unsigned l = 0; l < out->shells; l++) {
		size_t to = architecture->shell[l] < count ? architecture->shell[l] : count;
		out->square[l] = 0;
		gather_shell(out, l, work, from, to);
		from = to;
	}
}

/* ---- First fits ---- */

/* One support's regularised fit and the radius it counts in: mild penalties, the same for every patch. */
struct first {
	double factor[SIZE * STRIDE], mean[STRIDE];
	double power[ORDERS]; /* of the radius */
	double misfit;        /* mean square */
};

static void solve_first(const double *gram, const double *moment, double square, size_t count, double radius,
                        double ridge, struct first *first)
{
	double factor[SIZE];
	unsigned order[SIZE];
	gnp_taylor_indices(factor, order);
	first->power[0] = 1;
	for (int j = 1; j < ORDERS; j++)
		first->power[j] = first->power[j - 1] * radius;
	memcpy(first->factor, gram, sizeof first->factor);
	for (size_t i = 0; i < SIZE; i++) {
		double power = first->power[order[i]] * first->power[order[i]];
		first->factor[i * STRIDE + i] += power * (order[i] < 3 ? 1e-12 : ridge * (double)(count + 1) * factor[i]);
	}
	memset(first->mean, 0, sizeof first->mean);
	first->misfit = square / (double)(count + 1);
	if (!gnp_cholesky_factor(first->factor, SIZE, STRIDE, SMALLEST))
		return;
	double explained = 0;
	gnp_cholesky_forward(first->factor, SIZE, STRIDE, moment, first->mean);
	for (size_t i = 0; i < SIZE; i++)
		explained += first->mean[i] * first->mean[i];
	gnp_cholesky_backward(first->factor, SIZE, STRIDE, first->mean, first->mean);
	first->misfit = fmax(square - explained, 1e-15 * square) / (double)(count + 1);
}

static void summarise(const struct first *first, float *summary)
{
	double factor[SIZE], energy[ORDERS] = {0};
	unsigned order[SIZE];
	gnp_taylor_indices(factor, order);
	for (size_t i = 0; i < SIZE; i++) {
		double c = first->mean[i] * first->power[order[i]];
		energy[order[i]] += c * c * factor[i];
	}
	summary[0] = (float)(0.5 * log(first->misfit + 1e-30));
	for (int j = 1; j < ORDERS; j++)
		summary[j] = (float)(0.5 * log(energy[j] + 1e-16));
}

static double residual_at(const struct first *first, double u, double v, double y)
{
	double row[STRIDE];
	gnp_taylor_rows(GNP_TAYLOR_DEGREE, &u, &v, 1, STRIDE, row);
	for (size_t i = 0; i < SIZE; i++)
		y -= row[i] * first->mean[i];
	return y;
}

static void fill_nodes(const struct first *first, const struct gnp_projection_work *work, size_t count, double radius,
                       size_t features, float *nodes)
{
	double size = sqrt(first->misfit) + 1e-15;
	memset(nodes, 0, GNP_PROJECTION_NODES * features * sizeof *nodes);
	for (size_t n = 0; n < GNP_PROJECTION_NODES && count > 0; n++) {
		size_t i = n * (count - 1) / (GNP_PROJECTION_NODES - 1);
		double r = residual_at(first, work->u[i], work->v[i], work->y[i]) / size;
		nodes[n * features] = (float)(work->u[i] / radius);
		nodes[n * features + 1] = (float)(work->v[i] / radius);
		nodes[n * features + 2] = (float)(work->y[i] / radius);
		nodes[n * features + 3] = (float)fmax(-8, fmin(8, r));
	}
}

void gnp_projection_describe(const struct gnp_architecture *architecture, size_t k, const struct gnp_projection *sums,
                             const struct gnp_projection_work *work, float *summary, float *nodes)
{
	double gram[SIZE * STRIDE] = {0}, moment[STRIDE] = {0}, square = 0;
	double radius = sqrt((double)architecture->shell[sums->shells - 1] / (double)k);
	size_t count = 0, total = 0;
	struct first first, middle = {.misfit = 1};
	for (unsigned l = 0; l < sums->shells; l++) {
		count += sums->count[l];
		square += sums->square[l];
		for (size_t i = 0; i < SIZE * STRIDE; i++)
			gram[i] += sums->gram[l][i];
		for (size_t i = 0; i < STRIDE; i++)
			moment[i] += sums->moment[l][i];
		solve_first(gram, moment, square, count, sqrt((double)architecture->shell[l] / (double)k), architecture->ridge, &first);
		summarise(&first, summary + (size_t)l * ORDERS);
		if (l == sums->shells / 2)
			middle = first;
	}
	total = count;
	if (architecture->features > 0)
		fill_nodes(&middle, work, total, radius, architecture->features, nodes);
}

/* ---- The projection ---- */

static double softplus(double x)
{
	return x > 30 ? x : log1p(exp(x));
}

static void decode(const struct gnp_projection *sums, const float *outputs, struct gnp_projection_fit *fit)
{
	double fade = 0;
	for (int j = 0; j < ORDERS; j++)
		fit->ridge[j] = exp(fmax(-RIDGE_LOG_MAX, fmin(RIDGE_LOG_MAX, RIDGE_SLOPE * (double)outputs[j])));
	for (unsigned l = 0; l < sums->shells; l++) {
		fade += softplus(SHELL_SLOPE * (double)outputs[ORDERS + l]);
		fit->share[l] = exp(-fade);
	}
}

/* The normal equations' matrix in the factor's place, lifted by a share of its diagonal. */
static void assemble(const struct gnp_projection *sums, double lift, struct gnp_projection_fit *fit)
{
	double factor[SIZE];
	unsigned order[SIZE];
	gnp_taylor_indices(factor, order);
	memset(fit->factor, 0, sizeof fit->factor);
	for (unsigned l = 0; l < sums->shells; l++)
		for (size_t i = 0; i < SIZE * STRIDE; i++)
			fit->factor[i] += fit->share[l] * sums->gram[l][i];
	for (size_t i = 0; i < SIZE; i++)
		fit->factor[i * STRIDE + i] = (fit->factor[i * STRIDE + i] + fit->ridge[order[i]] * factor[i]) * (1 + lift);
}

bool gnp_projection_solve(const struct gnp_projection *sums, const float *outputs, struct gnp_projection_fit *fit)
{
	double right[STRIDE] = {0}, square = 0, explained = 0, lift = SMALLEST;
	bool solved = false;
	decode(sums, outputs, fit);
	fit->weight = 0;
	for (unsigned l = 0; l < sums->shells; l++) {
		square += fit->share[l] * sums->square[l];
		fit->weight += fit->share[l] * (double)sums->count[l];
		for (size_t i = 0; i < SIZE; i++)
			right[i] += fit->share[l] * sums->moment[l][i];
	}
	for (; !solved && lift < 1e-3; lift *= 100) {
		assemble(sums, lift, fit);
		solved = gnp_cholesky_factor(fit->factor, SIZE, STRIDE, SMALLEST);
	}
	memset(fit->coefficients, 0, sizeof fit->coefficients);
	fit->misfit = square;
	if (!solved)
		return false;
	gnp_cholesky_forward(fit->factor, SIZE, STRIDE, right, fit->coefficients);
	for (size_t i = 0; i < SIZE; i++)
		explained += fit->coefficients[i] * fit->coefficients[i];
	gnp_cholesky_backward(fit->factor, SIZE, STRIDE, fit->coefficients, fit->coefficients);
	fit->misfit = fmax(square - explained, 1e-15 * square);
	return true;
}

void gnp_projection_begin(const struct gnp_architecture *architecture, double spread, float *outputs)
{
	double last = architecture->shell[architecture->shells - 1];
	for (int j = 0; j < ORDERS; j++) {
		double ridge = j < 3 ? 1e-12 : architecture->ridge * last;
		outputs[j] = (float)((log(ridge) + j * log(spread)) / RIDGE_SLOPE);
	}
	for (unsigned l = 0; l < architecture->shells; l++)
		outputs[ORDERS + l] = l ? 0 : -1;
}

/* a^T G b of the symmetric matrix whose upper triangle is given. */
static double bilinear(const double *gram, const double *a, const double *b)
{
	double sum = 0;
	for (size_t i = 0; i < SIZE; i++) {
		double row = 0, mirrored = 0;
		for (size_t j = i; j < SIZE; j++)
			row += gram[i * STRIDE + j] * b[j];
		for (size_t j = i + 1; j < SIZE; j++)
			mirrored += gram[i * STRIDE + j] * a[j];
		sum += a[i] * row + b[i] * mirrored;
	}
	return sum;
}

void gnp_projection_solve_backward(const struct gnp_projection *sums, const float *outputs,
                                   const struct gnp_projection_fit *fit, const double *dcoefficients, float *doutputs)
{
	double factor[SIZE], adjoint[STRIDE] = {0}, dridge[ORDERS] = {0}, tail = 0;
	unsigned order[SIZE];
	gnp_taylor_indices(factor, order);
	memcpy(adjoint, dcoefficients, SIZE * sizeof *adjoint);
	gnp_cholesky_forward(fit->factor, SIZE, STRIDE, adjoint, adjoint);
	gnp_cholesky_backward(fit->factor, SIZE, STRIDE, adjoint, adjoint);
	for (size_t i = 0; i < SIZE; i++)
		dridge[order[i]] -= adjoint[i] * fit->coefficients[i] * factor[i];
	for (int j = 0; j < ORDERS; j++) {
		bool limited = fabs(RIDGE_SLOPE * (double)outputs[j]) > RIDGE_LOG_MAX;
		doutputs[j] = limited ? 0 : (float)(RIDGE_SLOPE * fit->ridge[j] * dridge[j]);
	}
	for (unsigned l = sums->shells; l-- > 0;) {
		double dshare = -bilinear(sums->gram[l], adjoint, fit->coefficients), x = SHELL_SLOPE * (double)outputs[ORDERS + l];
		for (size_t i = 0; i < SIZE; i++)
			dshare += adjoint[i] * sums->moment[l][i];
		tail += fit->share[l] * dshare;
		doutputs[ORDERS + l] = (float)(-SHELL_SLOPE / (1 + exp(-x)) * tail);
	}
}
