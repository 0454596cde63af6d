/* How well a model in training does on clouds it is not trained on, beside plane fits to the nearest 10 to 112 points.
 */
#ifndef GNP_WEIGHTS_ANY_WATCH_H
#define GNP_WEIGHTS_ANY_WATCH_H

#include "core/network/network.h"
#include "weights/train/any/any_cloud.h"

/* What is measured over all clouds. */
enum gnp_any_figure {
	GNP_ANY_RATIO,     /* root mean square angle of normals over that of the plane fit that is best on the cloud;
	                      geometric mean over clouds */
	GNP_ANY_ANGLE,     /* root mean square angle [degree] */
	GNP_ANY_FRAME,     /* the same of the frame chosen */
	GNP_ANY_CURVATURE, /* error of the Hessian over its size, where it is known; geometric mean */
	GNP_ANY_INSIDE_1,  /* share of angles within one and two expected errors */
	GNP_ANY_INSIDE_2,
	GNP_ANY_PRECISION, /* of creases flagged, on clouds of noise below 0.2 spacings */
	GNP_ANY_RECALL,
	GNP_ANY_FIGURES
};
const char *gnp_any_figure_name(enum gnp_any_figure figure);

struct gnp_any_watch;

/* Makes `clouds` clouds, of seeds from GNP_SEED_WATCH on: by turns radial, solid and rough, of 0, 0.05, 0.3, 1, 2.4
 * and 4.5 spacings of noise, without outliers or given normals; and chooses `centres` points of each. Borrows pool. */
gnp_status gnp_any_watch_open(const struct gnp_any_recipe *recipe, size_t clouds, size_t centres, struct gnp_pool *pool,
                              struct gnp_any_watch **out, struct gnp_error *error);
void gnp_any_watch_close(struct gnp_any_watch *watch);

/* Figures are NaN where nothing is known. */
gnp_status gnp_any_watch_run(struct gnp_any_watch *watch, const struct gnp_network *network,
                             double figures[GNP_ANY_FIGURES], struct gnp_error *error);

#endif
