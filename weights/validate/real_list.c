#include "weights/validate/real_list.h"

#include <stdio.h>
#include <string.h>

#include "clients/file_io.h"
#include "weights/validate/word_list.h"

static gnp_status take(const struct gnp_real_list *list, const char *name, gnp_real_list_fn visit, void *context,
                       struct gnp_error *error)
{
	struct gnp_real_mesh mesh;
	char path[1200];
	snprintf(path, sizeof path, "%s/%s.ply", list->folder, name);
	gnp_status status = gnp_real_mesh_read(path, &mesh, error);
	if (status != GNP_OK)
		return status;
	status = visit(context, name, &mesh, error);
	gnp_real_mesh_clear(&mesh);
	return status;
}

gnp_status gnp_real_list_visit(const struct gnp_real_list *list, gnp_real_list_fn visit, void *context,
                               struct gnp_error *error)
{
	char path[1200], name[64], role[16];
	struct gnp_buffer lines = {0};
	size_t wanted = 0;
	int length = 0;
	if (!list->folder)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "meshes: got none, need a folder as deploy/fetch-meshes.sh fills it");
	snprintf(path, sizeof path, "%s/meshes.txt", list->folder);
	gnp_status status = gnp_file_read(path, &lines, error);
	if (status == GNP_OK)
		status = gnp_buffer_append(&lines, "", 1, error);
	for (const char *at = (const char *)lines.data;
	     status == GNP_OK && sscanf(at, "%63s %15s%n", name, role, &length) == 2; at += length)
		if ((strcmp(role, "tune") == 0) == list->tune && gnp_word_list_has(list->only, name)) {
			wanted++;
			status = take(list, name, visit, context, error);
		}
	gnp_buffer_clear(&lines);
	if (status == GNP_OK && wanted == 0)
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: names no mesh that is wanted", path);
	return status;
}
