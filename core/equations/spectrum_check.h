/* Whether eigenpairs of -Delta can be believed: they are real and not negative, and a second discretisation gives their
 * vectors nearly the same values. Records a warning with the value found and its limit (warning.h). */
#ifndef GNP_CORE_SPECTRUM_CHECK_H
#define GNP_CORE_SPECTRUM_CHECK_H

#include "core/base/warning.h"
#include "core/equations/spectrum.h"

/* shift: of the size of the first eigenvalue, what deviations near zero are measured by. GNP_NO_CONVERGENCE for a value
 * that is not finite: so many others are far below zero that those wanted are not there. warnings may be NULL. */
gnp_status gnp_spectrum_believe(const struct gnp_spectrum *spectrum, const struct gnp_poisson *poisson, double shift,
                                struct gnp_warnings *warnings, struct gnp_error *error);

#endif
