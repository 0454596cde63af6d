#include "weights/validate/real_mesh.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clients/file_io.h"
#include "core/base/memory.h"
#include "core/base/vector.h"

enum { HEADER_MOST = 400, VERTEX_BYTES = 12, FACE_BYTES = 13, COUNT_MOST = 1 << 27 };

/* ---- Geometry ---- */

double gnp_real_mesh_normal(const struct gnp_real_mesh *mesh, size_t triangle, double normal[3])
{
	const uint32_t *corner = mesh->triangles + 3 * triangle;
	const double *a = mesh->vertices + 3 * (size_t)corner[0];
	double u[3], v[3];
	for (int c = 0; c < 3; c++) {
		u[c] = mesh->vertices[3 * (size_t)corner[1] + c] - a[c];
		v[c] = mesh->vertices[3 * (size_t)corner[2] + c] - a[c];
	}
	gnp_cross(u, v, normal);
	double length = sqrt(gnp_dot(normal, normal));
	for (int c = 0; c < 3; c++)
		normal[c] = length > 0 ? normal[c] / length : 0;
	return length / 2;
}

void gnp_real_mesh_vertex_normals(const struct gnp_real_mesh *mesh, double *normals)
{
	memset(normals, 0, mesh->vertex_count * 3 * sizeof *normals);
	for (size_t t = 0; t < mesh->triangle_count; t++) {
		double normal[3], area = gnp_real_mesh_normal(mesh, t, normal);
		for (int corner = 0; corner < 3; corner++)
			for (int c = 0; c < 3; c++)
				normals[3 * (size_t)mesh->triangles[3 * t + corner] + c] += area * normal[c];
	}
	for (size_t i = 0; i < mesh->vertex_count; i++) {
		double length = sqrt(gnp_dot(normals + 3 * i, normals + 3 * i));
		for (int c = 0; c < 3; c++)
			normals[3 * i + c] = length > 0 ? normals[3 * i + c] / length : 0;
	}
}

static void measure(struct gnp_real_mesh *mesh)
{
	double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, normal[3];
	for (size_t i = 0; i < 3 * mesh->vertex_count; i++) {
		low[i % 3] = fmin(low[i % 3], mesh->vertices[i]);
		high[i % 3] = fmax(high[i % 3], mesh->vertices[i]);
	}
	mesh->diagonal = sqrt(pow(high[0] - low[0], 2) + pow(high[1] - low[1], 2) + pow(high[2] - low[2], 2));
	mesh->area = 0;
	for (size_t t = 0; t < mesh->triangle_count; t++)
		mesh->area += gnp_real_mesh_normal(mesh, t, normal);
}

static gnp_status allocate(struct gnp_real_mesh *mesh, struct gnp_error *error)
{
	mesh->vertices = gnp_array_new(mesh->vertex_count, 3 * sizeof *mesh->vertices);
	mesh->triangles = gnp_array_new(mesh->triangle_count, 3 * sizeof *mesh->triangles);
	if (mesh->vertices && mesh->triangles)
		return GNP_OK;
	gnp_real_mesh_clear(mesh);
	return gnp_no_memory("mesh", mesh->triangle_count, "triangles", error);
}

gnp_status gnp_real_mesh_create(const double *vertices, size_t vertex_count, const uint32_t *triangles,
                                size_t triangle_count, struct gnp_real_mesh *out, struct gnp_error *error)
{
	struct gnp_real_mesh mesh = {.vertex_count = vertex_count, .triangle_count = triangle_count};
	gnp_status status = allocate(&mesh, error);
	if (status != GNP_OK)
		return status;
	memcpy(mesh.vertices, vertices, vertex_count * 3 * sizeof *vertices);
	memcpy(mesh.triangles, triangles, triangle_count * 3 * sizeof *triangles);
	measure(&mesh);
	*out = mesh;
	return GNP_OK;
}

void gnp_real_mesh_clear(struct gnp_real_mesh *mesh)
{
	free(mesh->vertices);
	free(mesh->triangles);
	*mesh = (struct gnp_real_mesh){0};
}

/* ---- Files ---- */

/* The header's counts; where the data begins is returned, 0 when it is not of the form. */
static size_t read_header(const struct gnp_buffer *file, size_t *vertices, size_t *faces)
{
	char text[HEADER_MOST + 1];
	size_t size = file->size < HEADER_MOST ? file->size : HEADER_MOST;
	int length = 0;
	memcpy(text, file->data, size);
	text[size] = '\0';
	if (sscanf(text,
	           "ply format binary_little_endian 1.0 element vertex %zu property float x property float y property "
	           "float z "
	           "element face %zu property list uchar int vertex_indices end_header%n",
	           vertices, faces, &length) != 2)
		return 0;
	return length > 0 && text[length] == '\n' ? (size_t)length + 1 : 0;
}

static gnp_status read_data(const char *path, const unsigned char *data, struct gnp_real_mesh *mesh,
                            struct gnp_error *error)
{
	const unsigned char *face = data + VERTEX_BYTES * mesh->vertex_count;
	for (size_t i = 0; i < 3 * mesh->vertex_count; i++) {
		float value;
		memcpy(&value, data + sizeof value * i, sizeof value);
		if (!isfinite(value))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%.200s: vertex %zu: not finite", path, i / 3);
		mesh->vertices[i] = (double)value;
	}
	for (size_t t = 0; t < mesh->triangle_count; t++, face += FACE_BYTES) {
		uint32_t *corner = mesh->triangles + 3 * t;
		memcpy(corner, face + 1, 3 * sizeof *corner);
		if (face[0] != 3)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%.200s: face %zu: got %d corners, need 3", path, t,
			                     face[0]);
		for (int c = 0; c < 3; c++)
			if (corner[c] >= mesh->vertex_count)
				return gnp_error_set(error, GNP_INVALID_ARGUMENT,
				                     "%.200s: face %zu: got corner %u, there are %zu vertices", path, t, corner[c],
				                     mesh->vertex_count);
	}
	return GNP_OK;
}

static gnp_status read_file(const char *path, const struct gnp_buffer *file, struct gnp_real_mesh *mesh,
                            struct gnp_error *error)
{
	size_t begin = read_header(file, &mesh->vertex_count, &mesh->triangle_count);
	if (begin == 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "%.200s: need a PLY file as deploy/mesh-to-triangles.js writes it", path);
	if (mesh->vertex_count < 4 || mesh->vertex_count > COUNT_MOST || mesh->triangle_count < 4 ||
	    mesh->triangle_count > COUNT_MOST)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "%.200s: got %zu vertices and %zu triangles, need 4..%d of each", path, mesh->vertex_count,
		                     mesh->triangle_count, COUNT_MOST);
	size_t need = begin + VERTEX_BYTES * mesh->vertex_count + FACE_BYTES * mesh->triangle_count;
	if (file->size != need)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%.200s: got %zu bytes, need %zu", path, file->size, need);
	gnp_status status = allocate(mesh, error);
	if (status == GNP_OK)
		status = read_data(path, (const unsigned char *)file->data + begin, mesh, error);
	if (status != GNP_OK)
		return status;
	measure(mesh);
	if (!(mesh->area > 0))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%.200s: its triangles have no area", path);
	return GNP_OK;
}

gnp_status gnp_real_mesh_read(const char *path, struct gnp_real_mesh *out, struct gnp_error *error)
{
	struct gnp_real_mesh mesh = {0};
	struct gnp_buffer file = {0};
	gnp_status status = gnp_file_read(path, &file, error);
	if (status == GNP_OK)
		status = read_file(path, &file, &mesh, error);
	gnp_buffer_clear(&file);
	if (status == GNP_OK)
		*out = mesh;
	else
		gnp_real_mesh_clear(&mesh);
	return status;
}
