#include "weights/train/any/any_truth.h"

#include <math.h>

#include "core/base/vector.h"

static const double UPRIGHT = 0.2;

/* a^T form b */
static double apply(const double form[9], const double a[3], const double b[3])
{
	double sum = 0;
	for (int i = 0; i < 3; i++)
		for (int j = 0; j < 3; j++)
			sum += a[i] * form[3 * i + j] * b[j];
	return sum;
}

/* h_ab = II(t_a, t_b) sqrt(1 + |grad h|^2) with tangents t_u = psi1 + h_u psi3, t_v = psi2 + h_v psi3. */
void gnp_any_truth_find(const struct gnp_any_cloud *cloud, const struct gnp_support *support, struct gnp_any_truth *out)
{
	const double *normal = cloud->normals + 3 * (size_t)support->centre,
				 *form = cloud->second_form + 9 * (size_t)support->centre;
	double sign = gnp_dot(normal, support->frame[2]) < 0 ? -1 : 1, tangent[2][3];
	for (int c = 0; c < 3; c++)
		out->normal[c] = sign * gnp_dot(normal, support->frame[c]);
	out->curved = out->normal[2] > UPRIGHT && !cloud->faceted;
	if (!out->curved)
		return;
	double slope[2] = {-out->normal[0] / out->normal[2], -out->normal[1] / out->normal[2]};
	for (int a = 0; a < 2; a++)
		for (int c = 0; c < 3; c++)
			tangent[a][c] = support->frame[a][c] + slope[a] * support->frame[2][c];
	double scale = sign * support->radius * sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
	out->hessian[0] = scale * apply(form, tangent[0], tangent[0]);
	out->hessian[1] = scale * apply(form, tangent[0], tangent[1]);
	out->hessian[2] = scale * apply(form, tangent[1], tangent[1]);
}

bool gnp_any_truth_near(const struct gnp_any_cloud *cloud, const struct gnp_support *support, size_t node,
                        double normal[3])
{
	size_t centre = support->centre, at = support->member[support->start[node]];
	const double *own = cloud->normals + 3 * centre, *there = cloud->normals + 3 * at;
	double sign = gnp_dot(own, support->frame[2]) < 0 ? -1 : 1;
	for (int c = 0; c < 3; c++)
		normal[c] = sign * gnp_dot(there, support->frame[c]);
	return !cloud->outlier[at] && cloud->piece[at] == cloud->piece[centre] && normal[2] > UPRIGHT;
}

void gnp_any_truth_label(const struct gnp_any_cloud *cloud, const struct gnp_support *support, double *strange)
{
	uint32_t own = cloud->piece[support->centre];
	for (size_t n = 0; n < support->nodes; n++) {
		size_t from = support->start[n], to = support->start[n + 1], count = 0;
		for (size_t i = from; i < to; i++) {
			uint32_t at = support->member[i];
			count += cloud->outlier[at] == GNP_ANY_OUTLIER || cloud->piece[at] != own;
		}
		strange[n] = (double)count / (double)(to - from);
	}
}
