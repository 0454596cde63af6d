/* The warnings of an answer: why it may be wrong, or is not what its user would expect, as the computation itself
 * found out.
 *
 * A warning has a kind and a sentence with the value found and the limit it passed: "precision: the points' numbers
 * have steps of 0.5 there, the spacing is 0.06: ...". Of each kind an answer has one; what comes later of the same
 * kind is not recorded. */
#ifndef GNP_CORE_WARNING_H
#define GNP_CORE_WARNING_H

#include <stddef.h>

/* In the order in which an answer lists them: enumerator, the word its text begins with, what it says. */
#define GNP_WARNING_TABLE(X)                                                                                                    \
	X(GNP_WARNING_PRECISION, "precision", "the numbers that the points came in are too coarse for their spacing")                \
	X(GNP_WARNING_RANGE, "range", "numbers of the answer too small for the type it has")                                          \
	X(GNP_WARNING_DROPPED, "dropped", "the filter dropped more points than contamination explains")                              \
	X(GNP_WARNING_COPIES, "copies", "points of a cloud that lie where another one does: an equation merges them")                \
	X(GNP_WARNING_ROWS, "rows", "points lie in rows much farther apart than the points in a row")                                \
	X(GNP_WARNING_RESOLUTION, "resolution", "too few points for the curvature of their surface")                                 \
	X(GNP_WARNING_SHEETS, "sheets", "sheets of the surface lie closer than patches are wide")                                    \
	X(GNP_WARNING_GIVEN_NORMALS, "given_normals", "normals that came with the cloud contradict its points")                     \
	X(GNP_WARNING_NORMALS, "normals", "estimated normals contradict the plane of a wider neighbourhood")                         \
	X(GNP_WARNING_DETAIL, "detail", "fits smooth away what their points show")                                                   \
	X(GNP_WARNING_STDERR, "stderr", "standard errors that noise makes too small")                                               \
	X(GNP_WARNING_DEGENERATE, "neighbourhoods", "neighbourhoods too poor for the basis: a lower degree was used there")         \
	X(GNP_WARNING_COMPONENTS, "components", "normals were estimated, and separate components oriented each by itself")          \
	X(GNP_WARNING_STENCILS, "stencils", "rows of a matrix that no Laplacian has")                                                 \
	X(GNP_WARNING_CROSSINGS, "crossings", "cells join points of sheets that face the same way")                                        \
	X(GNP_WARNING_OPERATOR, "operator", "a prepared operator that a second discretisation does not confirm")                      \
	X(GNP_WARNING_FLOW, "flow", "the flow ended before its steps were done")                                                     \
	X(GNP_WARNING_MEAN, "mean", "right-hand sides had a mean, which was removed")                                                \
	X(GNP_WARNING_RESIDUAL, "residual", "a system solved to few digits: it is near singular")                                     \
	X(GNP_WARNING_ENERGY, "energy", "a solution that a second discretisation does not confirm")                                  \
	X(GNP_WARNING_EIGENVALUES, "eigenvalues", "negative or complex eigenvalues, or such as a second discretisation does not have") \
	X(GNP_WARNING_HEAT, "heat", "heat beyond the range of what it began with, or more or less of it in all")                                                   \
	X(GNP_WARNING_DISTANCE, "distance", "distances that were shorter than the straight line")

enum gnp_warning_kind {
#define GNP_WARNING_ENUM(id, name, help) id,
	GNP_WARNING_TABLE(GNP_WARNING_ENUM)
#undef GNP_WARNING_ENUM
	GNP_WARNING_KINDS
};

enum { GNP_WARNING_TEXT_MAX = 320 };

/* Plain data: zeroed, there are none. */
struct gnp_warnings {
	char text[GNP_WARNING_KINDS][GNP_WARNING_TEXT_MAX]; /* "kind: sentence", NUL-terminated; empty where there is none */
};

/* Records a sentence of that kind unless there is one; warnings may be NULL. What is too long for the text is cut at a word. Sentences have no
 * "; " within, which parts warnings in reports: there a comma is written. */
void gnp_warnings_add(struct gnp_warnings *warnings, enum gnp_warning_kind kind, const char *format, ...)
	__attribute__((format(printf, 3, 4)));
/* Takes over those of kinds that `to` has none of; either may be NULL. */
void gnp_warnings_merge(struct gnp_warnings *to, const struct gnp_warnings *from);
size_t gnp_warnings_count(const struct gnp_warnings *warnings);
const char *gnp_warning_name(enum gnp_warning_kind kind);

#endif
