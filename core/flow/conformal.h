/* Conformalized mean-curvature flow (Kazhdan, Solomon & Ben-Chen, Can Mean-Curvature Flow be Modified to be
 * Non-singular?, 2012): (M_t + dt/2 S_0) x' = M_t x, with the stiffness of the start and the masses of the moment, so
 * that necks do not pinch and surfaces of genus 0 become spheres. Points keep the neighbours they had at the start, so
 * nothing is searched or estimated on the way. */
#ifndef GNP_CORE_CONFORMAL_H
#define GNP_CORE_CONFORMAL_H

#include "core/base/pool.h"
#include "core/flow/flow_state.h"

struct gnp_conformal;

/* start: measured, with edges. Keeps nothing of it. task may be NULL; polled. */
gnp_status gnp_conformal_create(const struct gnp_flow_state *start, struct gnp_task *task, struct gnp_conformal **out,
                                struct gnp_error *error);
void gnp_conformal_free(struct gnp_conformal *conformal);

/* Masses, normals and H of a state from the fans of triangles about its points; principal curvatures both become H. */
gnp_status gnp_conformal_measure(const struct gnp_conformal *conformal, struct gnp_flow_state *state,
                                 const double origin[3], struct gnp_pool *pool, struct gnp_task *task, bool *finite,
                                 struct gnp_error *error);

/* *next: points and what they carry, to be measured. volume: what all but held points are scaled about the centroid to
 * enclose, negative where normals point inwards; 0: they are not. */
gnp_status gnp_conformal_step(const struct gnp_conformal *conformal, const struct gnp_flow_state *state, double dt,
                              double volume, struct gnp_pool *pool, struct gnp_task *task, struct gnp_flow_state *next,
                              struct gnp_error *error);

#endif
