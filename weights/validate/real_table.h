/* The real table: scores of every method on every cloud, and their summary by section. */
#ifndef GNP_WEIGHTS_REAL_TABLE_H
#define GNP_WEIGHTS_REAL_TABLE_H

#include <stdio.h>

#include "weights/validate/real_detail.h"
#include "weights/validate/real_filter.h"
#include "weights/validate/real_method.h"

enum gnp_real_section {
	GNP_REAL_SAMPLES,  /* points on the triangles of meshes */
	GNP_REAL_VERTICES, /* the vertices of meshes */
	GNP_REAL_BODIES,   /* exact bodies and open patches */
	GNP_REAL_SCANS,    /* rows of points and a spinning lidar */
	GNP_REAL_SECTIONS
};
/* In files, and as headings. NULL past the last. */
const char *gnp_real_section_name(unsigned section);
const char *gnp_real_section_title(enum gnp_real_section section);

/* What is judged. */
struct gnp_real_plan {
	const char *meshes; /* folder with meshes.txt and its files */
	const char *peers;  /* folder of programs; NULL: none */
	const char *only;   /* names of meshes with commas; NULL: all */
	size_t points;      /* on the triangles of a mesh */
	size_t centres;     /* a cloud; 0: all */
	unsigned sections;  /* mask */
	bool tune;          /* the meshes for decisions in training alone, instead of those that judge */
	bool ablate;        /* each model with parts of it taken away, too */
};
/* 100,000 points and 5,000 centres; quick: 20,000 and 500, without peers. */
struct gnp_real_plan gnp_real_plan_full(void);
struct gnp_real_plan gnp_real_plan_quick(void);

/* Who is looked at closer on exact bodies. */
enum gnp_real_detailed { GNP_REAL_DETAIL_GNP, GNP_REAL_DETAIL_ADAPTIVE, GNP_REAL_DETAILS };
const char *gnp_real_detail_name(unsigned which); /* the method's */
const char *gnp_real_hardness_name(enum gnp_real_hardness hardness);

struct gnp_real_row {
	enum gnp_real_section section;
	char cloud[64], variant[32]; /* the surface, and how it is sampled */
	size_t points, centres;
	enum gnp_real_hardness hardness;
	struct gnp_real_detail details[GNP_REAL_DETAILS];
	struct gnp_real_score scores[GNP_REAL_METHODS_MAX][GNP_REAL_VARIANTS];
};

struct gnp_real_table {
	struct gnp_real_plan plan;
	size_t method_count, row_count, mesh_count;
	struct gnp_real_method methods[GNP_REAL_METHODS_MAX];
	double seconds[GNP_REAL_METHODS_MAX]; /* wall time over all clouds */
	double wall;                             /* seconds of the whole run */
	struct gnp_real_row *rows;
	struct gnp_real_mesh_fact {
		char name[64];
		size_t vertices, triangles;
	} * meshes; /* (mesh_count) */
	size_t filter_count;
	struct gnp_real_filter_row {
		char cloud[64], variant[32];
		double planted; /* deviation of what was planted over the diagonal; 0: none was */
		struct gnp_real_filtered filtered;
	} * filters; /* (filter_count) of the default filter; none without the model for any cloud */
};
void gnp_real_table_clear(struct gnp_real_table *table);

/* A row of no scores at the end of the table, a mesh, and a row of the filter. NULL when memory is exhausted. */
struct gnp_real_row *gnp_real_table_add(struct gnp_real_table *table);
struct gnp_real_mesh_fact *gnp_real_table_add_mesh(struct gnp_real_table *table);
struct gnp_real_filter_row *gnp_real_table_add_filter(struct gnp_real_table *table);

/* What a section goes by: the median angle of vertices, else the root mean square angle. */
double gnp_real_table_figure(const struct gnp_real_row *row, size_t method, size_t variant);
/* A method's best variant in a row by that. */
size_t gnp_real_table_variant(const struct gnp_real_table *table, const struct gnp_real_row *row, size_t method);
/* That figure; none counts as below a tenth of a degree. */
double gnp_real_table_best(const struct gnp_real_table *table, const struct gnp_real_row *row, size_t method);
/* The score of the best variant. */
const struct gnp_real_score *gnp_real_table_score(const struct gnp_real_table *table, const struct gnp_real_row *row,
                                                  size_t method);
/* The method of a name; method_count when there is none. */
size_t gnp_real_table_find(const struct gnp_real_table *table, const char *name);

/* One method over the rows of a section. Ratios are of figures, none of which counts as below a tenth of a degree.
 */
struct gnp_real_summary {
	size_t rows;
	double ratio;                   /* mean of its figure over that of the best PCA */
	double best;                    /* share of rows where no other method is better */
	double worst;                   /* largest ratio to the best other method */
	double mean;                    /* of its figure [degrees] */
	double within[GNP_REAL_WITHIN]; /* means of the shares */
	double least;                   /* the smallest share within 15 degrees */
	double sided;
};
/* Other methods are those that are not ablated ones. */
struct gnp_real_summary gnp_real_table_summary(const struct gnp_real_table *table, enum gnp_real_section section,
                                               size_t method);

/* Errors of writing are left in the stream. */
void gnp_real_table_write_text(const struct gnp_real_table *table, FILE *out);
void gnp_real_table_write_markdown(const struct gnp_real_table *table, FILE *out);
void gnp_real_table_write_json(const struct gnp_real_table *table, FILE *out);

#endif
