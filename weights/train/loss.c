#include "weights/train/loss.h"

#include <math.h>
#include <string.h>

#include "core/base/vector.h"

static const double TINY = 1e-8; /* of a denominator, the truth may be flat; and what an error counts as at least */

const char *gnp_loss_name(enum gnp_loss_term term)
{
	static const char *const names[GNP_LOSS_TERMS] = {
#define GNP_LOSS_NAME(id, name) name,
		GNP_LOSS_TABLE(GNP_LOSS_NAME)
#undef GNP_LOSS_NAME
	};
	return names[term];
}

bool gnp_loss_rule_asks(const struct gnp_loss_rule *rule)
{
	double sum = 0;
	for (int t = 0; t < GNP_LOSS_TERMS; t++)
		sum += rule->lambda[t];
	return sum > 0;
}

struct gnp_loss_options gnp_loss_defaults(void)
{
	struct gnp_loss_options options = {.patch = {.most = 5}, .centre = {.floor = 1, .most = 5},
	                                   .cell = {.most = HUGE_VAL}, .near = {.most = HUGE_VAL}, .points = 1};
	options.patch.lambda[GNP_LOSS_HEIGHT] = 1;
	options.patch.lambda[GNP_LOSS_NORMAL] = 0.5;
	options.patch.lambda[GNP_LOSS_INVERSE_METRIC] = 0.5;
	options.patch.lambda[GNP_LOSS_SECOND_FORM] = 0.5;
	options.patch.lambda[GNP_LOSS_GAUSSIAN] = 0.5;
	options.centre.lambda[GNP_LOSS_MEAN] = 1;
	return options;
}

struct gnp_loss_scale gnp_loss_scale_of(const struct gnp_train_cloud *cloud, const struct gnp_patch *patch)
{
	struct gnp_loss_scale scale = {{0}};
	scale.typical[GNP_LOSS_HEIGHT] = patch->scale_w / 2;
	scale.typical[GNP_LOSS_INVERSE_METRIC] = sqrt(2); /* the plane's */
	scale.typical[GNP_LOSS_SECOND_FORM] = cloud->typical_form;
	scale.typical[GNP_LOSS_GAUSSIAN] = cloud->typical_gaussian;
	scale.typical[GNP_LOSS_MEAN] = cloud->typical_mean;
	scale.typical[GNP_LOSS_ANGLE] = cloud->typical_form * patch->scale_xy; /* what a patch bends by */
	return scale;
}

/* ---- Quantities of a jet; symmetric tensors as xx, xy, yy ---- */

struct quantities {
	double g, root; /* det g and its square root */
	double normal[3], inverse[3], form[3], gaussian, mean;
};

static struct quantities quantities_of(const struct gnp_jet *h)
{
	struct quantities q;
	double p = h->u, r = h->v;
	q.g = 1 + p * p + r * r;
	q.root = sqrt(q.g);
	q.normal[0] = -p / q.root;
	q.normal[1] = -r / q.root;
	q.normal[2] = 1 / q.root;
	q.inverse[0] = (1 + r * r) / q.g;
	q.inverse[1] = -p * r / q.g;
	q.inverse[2] = (1 + p * p) / q.g;
	q.form[0] = h->uu / q.root;
	q.form[1] = h->uv / q.root;
	q.form[2] = h->vv / q.root;
	q.gaussian = (h->uu * h->vv - h->uv * h->uv) / (q.g * q.g);
	q.mean = 0.5 * ((1 + r * r) * h->uu - 2 * p * r * h->uv + (1 + p * p) * h->vv) / (q.g * q.root);
	return q;
}

/* d loss / d quantity; tensors' off-diagonal entries as they stand in the struct (once). */
struct adjoint {
	double normal[3], inverse[3], form[3], gaussian, mean;
};

/* Adds the adjoint, through the derivatives of quantities_of, to that of the jet. */
static void pull_back(const struct gnp_jet *h, const struct quantities *q, const struct adjoint *a, struct gnp_jet *out)
{
	double p = h->u, r = h->v, g = q->g, root = q->root, g15 = g * root, g2 = g * g;
	double normal = gnp_dot(a->normal, q->normal), inverse = gnp_dot(a->inverse, q->inverse), form = gnp_dot(a->form, q->form);
	double along = (normal + form + 4 * a->gaussian * q->gaussian + 3 * a->mean * q->mean + 2 * inverse) / g;
	out->u += -a->normal[0] / root + (2 * a->inverse[2] * p - a->inverse[1] * r) / g +
	          a->mean * (p * h->vv - r * h->uv) / g15 - p * along;
	out->v += -a->normal[1] / root + (2 * a->inverse[0] * r - a->inverse[1] * p) / g +
	          a->mean * (r * h->uu - p * h->uv) / g15 - r * along;
	out->uu += a->form[0] / root + a->gaussian * h->vv / g2 + a->mean * 0.5 * (1 + r * r) / g15;
	out->uv += a->form[1] / root - 2 * a->gaussian * h->uv / g2 - a->mean * p * r / g15;
	out->vv += a->form[2] / root + a->gaussian * h->uu / g2 + a->mean * 0.5 * (1 + p * p) / g15;
}

/* ---- Terms ---- */

static double square(double x)
{
	return x * x;
}

static double tensor_square(const double a[3])
{
	return a[0] * a[0] + 2 * a[1] * a[1] + a[2] * a[2];
}

static double tensor_distance(const double a[3], const double b[3])
{
	const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
	return tensor_square(d);
}

void gnp_loss_add(struct gnp_loss_sums *sums, double weight, const struct gnp_jet *jet, const struct gnp_jet *truth)
{
	struct quantities f = quantities_of(jet), t = quantities_of(truth);
	double angle = 0;
	for (int c = 0; c < 3; c++)
		angle += square(f.normal[c] - t.normal[c]);
	sums->error[GNP_LOSS_HEIGHT] += weight * square(jet->f - truth->f);
	sums->size[GNP_LOSS_HEIGHT] += weight * square(truth->f);
	sums->error[GNP_LOSS_ANGLE] += weight * angle;
	sums->error[GNP_LOSS_INVERSE_METRIC] += weight * tensor_distance(f.inverse, t.inverse);
	sums->size[GNP_LOSS_INVERSE_METRIC] += weight * tensor_square(t.inverse);
	sums->error[GNP_LOSS_SECOND_FORM] += weight * tensor_distance(f.form, t.form);
	sums->size[GNP_LOSS_SECOND_FORM] += weight * tensor_square(t.form);
	sums->error[GNP_LOSS_GAUSSIAN] += weight * square(f.gaussian - t.gaussian);
	sums->size[GNP_LOSS_GAUSSIAN] += weight * square(t.gaussian);
	sums->error[GNP_LOSS_MEAN] += weight * square(f.mean - t.mean);
	sums->size[GNP_LOSS_MEAN] += weight * square(t.mean);
}

/* A term's value, and its factor: d (lambda term) / d f_i = factor w_i (f_i - f*_i). */
struct graded {
	double value, factor;
};

static bool is_curvature(enum gnp_loss_term term)
{
	return term == GNP_LOSS_SECOND_FORM || term == GNP_LOSS_GAUSSIAN || term == GNP_LOSS_MEAN;
}

static struct graded grade(const struct gnp_loss_rule *rule, const struct gnp_loss_scale *scale, const struct gnp_loss_sums *sums,
                           enum gnp_loss_term term)
{
	double lambda = rule->lambda[term];
	if (term == GNP_LOSS_NORMAL) /* 1 - n . n* = |n - n*|^2 / 2, which keeps its digits where they agree */
		return (struct graded){sums->error[GNP_LOSS_ANGLE] / 2, lambda};
	double floor = term == GNP_LOSS_ANGLE ? scale->typical[term] : rule->floor * scale->typical[term];
	double root = sqrt(sums->error[term]), size = sqrt(sums->size[term] + floor * floor) + TINY;
	struct graded graded = {root / size, root > 0 ? lambda / (root * size) : 0};
	if (is_curvature(term) && graded.value > rule->most)
		graded = (struct graded){rule->most, 0};
	return graded;
}

static void grade_all(const struct gnp_loss_rule *rule, const struct gnp_loss_scale *scale, const struct gnp_loss_sums *sums,
                      struct graded graded[GNP_LOSS_TERMS])
{
	for (int t = 0; t < GNP_LOSS_TERMS; t++)
		graded[t] = grade(rule, scale, sums, (enum gnp_loss_term)t);
}

static void add_gradient(const struct graded graded[GNP_LOSS_TERMS], double w, const struct gnp_jet *h,
                         const struct gnp_jet *truth, struct gnp_jet *gradient)
{
	struct quantities f = quantities_of(h), t = quantities_of(truth);
	struct adjoint a;
	double turn = w * (graded[GNP_LOSS_ANGLE].factor + graded[GNP_LOSS_NORMAL].factor);
	for (int c = 0; c < 3; c++) {
		double entries = c == 1 ? 2 : 1;
		a.normal[c] = turn * (f.normal[c] - t.normal[c]);
		a.inverse[c] = w * entries * graded[GNP_LOSS_INVERSE_METRIC].factor * (f.inverse[c] - t.inverse[c]);
		a.form[c] = w * entries * graded[GNP_LOSS_SECOND_FORM].factor * (f.form[c] - t.form[c]);
	}
	a.gaussian = w * graded[GNP_LOSS_GAUSSIAN].factor * (f.gaussian - t.gaussian);
	a.mean = w * graded[GNP_LOSS_MEAN].factor * (f.mean - t.mean);
	gradient->f += w * graded[GNP_LOSS_HEIGHT].factor * (h->f - truth->f);
	pull_back(h, &f, &a, gradient);
}

/* ---- Judgements ---- */

static double weight_of(const struct gnp_loss_rule *rule, const struct gnp_truth *truth, size_t i)
{
	double r2 = square(truth[i].u - truth[0].u) + square(truth[i].v - truth[0].v);
	return rule->focus > 0 ? exp(-r2 / (2 * square(rule->focus))) : 1;
}

/* The loss of the first `count` points by a rule; gradient is added to. */
static double judge(const struct gnp_loss_rule *rule, const struct gnp_loss_scale *scale, const struct gnp_truth *truth,
                    const struct gnp_jet *jets, size_t count, double values[GNP_LOSS_TERMS], struct gnp_jet *gradient)
{
	struct gnp_loss_sums sums = {{0}, {0}};
	struct graded graded[GNP_LOSS_TERMS];
	double total = 0, loss = 0;
	for (size_t i = 0; i < count; i++)
		total += weight_of(rule, truth, i);
	for (size_t i = 0; i < count; i++)
		gnp_loss_add(&sums, weight_of(rule, truth, i) / total, &jets[i], &truth[i].jet);
	grade_all(rule, scale, &sums, graded);
	for (size_t i = 0; gradient && i < count; i++)
		add_gradient(graded, weight_of(rule, truth, i) / total, &jets[i], &truth[i].jet, &gradient[i]);
	for (int t = 0; t < GNP_LOSS_TERMS; t++) {
		values[t] = graded[t].value;
		loss += rule->lambda[t] * graded[t].value;
	}
	return loss;
}

double gnp_loss_cell(const struct gnp_loss_rule *rule, const struct gnp_loss_scale *scale, const struct gnp_truth *const *truth,
                     const struct gnp_jet *jets, size_t count, double values[GNP_LOSS_TERMS], struct gnp_jet *gradient)
{
	struct gnp_loss_sums sums = {{0}, {0}};
	struct graded graded[GNP_LOSS_TERMS];
	double w = 1 / (double)count, loss = 0;
	memset(gradient, 0, count * sizeof *gradient);
	for (size_t i = 0; i < count; i++)
		gnp_loss_add(&sums, w, &jets[i], &truth[i]->jet);
	grade_all(rule, scale, &sums, graded);
	for (int t = 0; t < GNP_LOSS_TERMS; t++) {
		double value = graded[t].value + (t == GNP_LOSS_NORMAL ? TINY * TINY : TINY);
		values[t] = graded[t].value;
		double power = pow(value, rule->power); /* 1 where the power is 0 */
		loss += rule->lambda[t] * (rule->power > 0 ? power / rule->power : log(value));
		graded[t].factor *= power / value;
	}
	for (size_t i = 0; i < count; i++)
		add_gradient(graded, w, &jets[i], &truth[i]->jet, &gradient[i]);
	return loss;
}

double gnp_loss_patch(const struct gnp_loss_options *options, const struct gnp_loss_scale *scale, const struct gnp_truth *truth,
                      const struct gnp_jet *jets, size_t count, struct gnp_loss_terms *terms, struct gnp_jet *gradient)
{
	struct gnp_loss_terms values = {.cell = {0}};
	if (gradient)
		memset(gradient, 0, count * sizeof *gradient);
	double loss = judge(&options->patch, scale, truth, jets, count, values.patch, gradient);
	loss += judge(&options->centre, scale, truth, jets, 1, values.centre, gradient);
	if (terms)
		*terms = values;
	return loss;
}
