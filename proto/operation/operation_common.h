/* What the operations on surfaces share: their inputs, the parameters of the estimate behind them, the way of
 * tensors to the core and back, and the part of the report that is the estimate's. */
#ifndef GNP_PROTO_OPERATION_COMMON_H
#define GNP_PROTO_OPERATION_COMMON_H

#include <stddef.h>

#include "core/estimate/estimate.h"
#include "proto/operation/call.h"
#include "proto/tensor/message.h"

/* The first rows of a table of inputs. */
#define GNP_COMMON_INPUTS                                                     \
	{"points", GNP_FP32, 2, {-1, 3}, false, "the cloud, in any length unit"}, \
	{"normals", GNP_FP32, 2, {-1, 3}, true,                                   \
	 "outward normals of any non-zero length; estimated and oriented when absent"}

/* Words of choices, in the order of the enumerations in estimate.h and estimator.h; NULL-terminated. */
extern const char *const gnp_common_estimators[], *const gnp_common_covers[], *const gnp_common_bases[],
	*const gnp_common_weights[], *const gnp_common_outliers[];

/* The first rows of a table of parameters. type: the options struct; core: its struct gnp_estimate_options; text:
 * its model's name. */
#define GNP_COMMON_PARAMETERS(type, core, text)                                                                        \
	{"estimator", GNP_PARAMETER_CHOICE, offsetof(type, core.estimator), 0, 0, gnp_common_estimators,                   \
	 "gnp: a geometric neural operator; gmls: moving least squares; adaptive: robust, with standard errors, finds "    \
	 "support and degree itself"},                                                                                     \
	{"weights", GNP_PARAMETER_MODEL, offsetof(type, text), 0, 0, NULL,                                                 \
	 "the model (gnp); auto: the one for any cloud, which weighs every point's neighbours"},                                      \
	{"cover", GNP_PARAMETER_CHOICE, offsetof(type, core.cover), 0, 0, gnp_common_covers,                               \
	 "cover: a patch serves several neighbouring points; all: one for every point, or as good as that"},                        \
	{"k", GNP_PARAMETER_INTEGER, offsetof(type, core.k), 12, 500, NULL,                                                \
	 "neighbours that set the patch radius, 1.1 times the k-th distance (gmls, adaptive; with gnp the model's)"},      \
	{"degree", GNP_PARAMETER_INTEGER, offsetof(type, core.degree), 1, 7, NULL, "degree of the Legendre basis (gmls)"}, \
	{"basis", GNP_PARAMETER_CHOICE, offsetof(type, core.basis), 0, 0, gnp_common_bases,                               \
	 "tensor or total degree (gmls)"},                                                                                 \
	{"weight", GNP_PARAMETER_CHOICE, offsetof(type, core.weight), 0, 0, gnp_common_weights,                            \
	 "weight over the patch: quartic (1-r)^4, flat 1, linear 1.2-r (gmls)"},                                           \
	{"outliers", GNP_PARAMETER_CHOICE, offsetof(type, core.outliers), 0, 0, gnp_common_outliers,                       \
	 "outliers in what the model sees (gnp): kept or left_out; auto: left_out with a model of the regime outlier; "    \
	 "weights=auto weighs every point itself"}

/* The last row: which outputs are answered. type: the options struct, which has a uint64_t `outputs`. */
#define GNP_COMMON_OUTPUTS(type) \
	{"outputs", GNP_PARAMETER_SET, offsetof(type, outputs), 0, 0, NULL, "comma-separated names of outputs, or all"}

#define GNP_COMMON_AUTO "auto"

/* Finds the model called weights among those loaded. "auto" is left to the core, and so is a model by_default that
 * the estimator has no use for. */
gnp_status gnp_common_resolve(struct gnp_estimate_options *options, const char *weights, const char *by_default,
                              const struct gnp_models *models, struct gnp_error *error);

/* GNP_INVALID_ARGUMENT when a call's cloud has fewer than `least` points, or than the neighbourhood of its
 * estimator. */
gnp_status gnp_common_check_points(const struct gnp_call *call, const struct gnp_estimate_options *options,
                                   size_t least, struct gnp_error *error);

/* Whether a call's cloud comes with normals. */
bool gnp_common_given(const struct gnp_call *call);

/* Bytes of a call's points and normals as the numbers that struct gnp_common_cloud holds. */
size_t gnp_common_cloud_memory(const struct gnp_call *call);

/* count times width, or SIZE_MAX; and added to another number of bytes. */
size_t gnp_common_memory(size_t count, size_t width, size_t more);

/* points and normals of a request as numbers. Owned; gnp_common_cloud_clear frees it, also after a failure. */
struct gnp_common_cloud {
	size_t count;
	double *points;           /* (count, 3) */
	double *normals;          /* (count, 3), or NULL */
	enum gnp_datatype type;   /* of the geometry in the answer: FP64 where points are, else FP32 */
};
gnp_status gnp_common_cloud_read(const struct gnp_request *request, struct gnp_common_cloud *out,
                                 struct gnp_error *error);
void gnp_common_cloud_clear(struct gnp_common_cloud *cloud);

/* A mask (n) of the request, whose values are known to be 0 and 1; *mask is NULL when there is none. Freed by the
 * caller. */
gnp_status gnp_common_mask_read(const struct gnp_request *request, const char *name, unsigned char **mask,
                                struct gnp_error *error);

/* Rounds numbers to single precision within their memory; what they no longer need is given back.
 * GNP_INVALID_ARGUMENT by the output's name where one is too large for that: then they are spoilt. *vanished: how
 * many that are not 0 were too small for it. */
gnp_status gnp_common_round(const char *name, double **values, size_t count, size_t *vanished, struct gnp_error *error);
/* Warns where that is most of them. Coordinator. */
void gnp_common_warn_of_range(const char *name, size_t vanished, size_t count, struct gnp_task *task);

/* Adds an output of `rows` rows; its other extents are the table's. numbers: of `type`, or of info's where that is
 * none of geometry; they are handed over, and *values is NULL on success. The task is warned of numbers too small
 * for their type. copy: of info's type. */
gnp_status gnp_common_add_numbers(struct gnp_tensors *outputs, const struct gnp_tensor_info *info,
                                  enum gnp_datatype type,
                                  size_t rows, double **values, struct gnp_task *task, struct gnp_error *error);
gnp_status gnp_common_add_copy(struct gnp_tensors *outputs, const struct gnp_tensor_info *info, size_t rows,
                               const void *values, struct gnp_error *error);

/* What became known of the surface. */
struct gnp_common_facts {
	const struct gnp_model *model;          /* NULL: the estimator uses none */
	bool normals_estimated;
	/* As in struct gnp_estimate; components, patches 0: not counted. */
	size_t components, patches, degenerate, outliers;
};

/* The beginning of a report: estimator and its choices, normals, patches. */
gnp_status gnp_common_report(const struct gnp_common_facts *facts, const struct gnp_estimate_options *options,
                             struct gnp_values *report, struct gnp_error *error);
/* Its end: the seconds of the stages, and the task's warnings with those that follow from facts: one text, parted by
 * "; ". task may be NULL. */
gnp_status gnp_common_report_end(const struct gnp_common_facts *facts, const struct gnp_task *task,
                                 struct gnp_values *report, struct gnp_error *error);

#endif
