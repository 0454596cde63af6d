#include "weights/validate/real_peer.h"

#include <fcntl.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "clients/file_io.h"

extern char **environ;

static const struct gnp_real_peer known[] = {
	{"open3d_pca", "open3d", "pca"},
	{"pcl_pca", "pcl", "pca"},
	{"pcl_mls", "pcl", "mls"},
	{"cgal_jets", "cgal", "jets"},
};

static const char *const files[] = {"cloud", "centres", "normals", "seconds"};
enum { CLOUD, CENTRES, NORMALS, SECONDS, FILES, PATH_SIZE = 640 };

const struct gnp_real_peer *gnp_real_peer_at(size_t i)
{
	return i < sizeof known / sizeof known[0] ? &known[i] : NULL;
}

static const char *path_of(const struct gnp_real_peers *peers, int file, char path[PATH_SIZE])
{
	snprintf(path, PATH_SIZE, "%s/%s", peers->meeting, files[file]);
	return path;
}

gnp_status gnp_real_peers_open(const char *folder, struct gnp_real_peers *peers, struct gnp_error *error)
{
	*peers = (struct gnp_real_peers){.centres = 0};
	if (folder && strlen(folder) >= sizeof peers->folder)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "peers: got a path of %zu bytes, need at most %zu",
		                     strlen(folder), sizeof peers->folder - 1);
	snprintf(peers->folder, sizeof peers->folder, "%s", folder ? folder : "");
	return gnp_temporary_folder(peers->meeting, error);
}

void gnp_real_peers_close(struct gnp_real_peers *peers)
{
	char path[PATH_SIZE];
	for (int file = 0; file < FILES; file++)
		unlink(path_of(peers, file, path));
	rmdir(peers->meeting);
}

bool gnp_real_peers_have(const struct gnp_real_peers *peers, const struct gnp_real_peer *peer)
{
	char path[PATH_SIZE];
	if (!peers || !peers->folder[0])
		return false;
	snprintf(path, sizeof path, "%s/%s", peers->folder, peer->program);
	return access(path, X_OK) == 0;
}

gnp_status gnp_real_peers_give(struct gnp_real_peers *peers, const struct gnp_real_cloud *cloud,
                               struct gnp_error *error)
{
	char path[PATH_SIZE];
	peers->centres = cloud->centre_count;
	gnp_status status =
		gnp_file_write(path_of(peers, CLOUD, path), cloud->points, cloud->count * 3 * sizeof *cloud->points, error);
	if (status == GNP_OK)
		status = gnp_file_write(path_of(peers, CENTRES, path), cloud->centres,
		                        cloud->centre_count * sizeof *cloud->centres, error);
	return status;
}

/* Runs the program to its end, its standard output in a file; its exit status, -1 when it did not start or was killed.
 */
static int run_program(const struct gnp_real_peers *peers, char *const arguments[])
{
	posix_spawn_file_actions_t actions;
	char seconds[PATH_SIZE];
	int state = -1;
	pid_t child;
	if (posix_spawn_file_actions_init(&actions) != 0)
		return -1;
	bool ready = posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, path_of(peers, SECONDS, seconds),
	                                              O_WRONLY | O_CREAT | O_TRUNC, 0600) == 0;
	if (ready && posix_spawn(&child, arguments[0], &actions, NULL, arguments, environ) == 0)
		if (waitpid(child, &state, 0) != child || !WIFEXITED(state))
			state = -1;
	posix_spawn_file_actions_destroy(&actions);
	return state == -1 ? -1 : WEXITSTATUS(state);
}

static gnp_status take_normals(const struct gnp_real_peers *peers, const struct gnp_real_peer *peer, size_t count,
                               double *normals, struct gnp_error *error)
{
	char path[PATH_SIZE];
	struct gnp_buffer file = {0};
	size_t size = count * peers->centres * 3 * sizeof *normals;
	gnp_status status = gnp_file_read(path_of(peers, NORMALS, path), &file, error);
	if (status == GNP_OK && file.size != size)
		status = gnp_error_set(error, GNP_UNAVAILABLE, "%s: wrote %zu bytes of normals, need %zu", peer->name,
		                       file.size, size);
	if (status == GNP_OK)
		memcpy(normals, file.data, size);
	gnp_buffer_clear(&file);
	return status;
}

static gnp_status take_seconds(const struct gnp_real_peers *peers, const struct gnp_real_peer *peer, double *seconds,
                               struct gnp_error *error)
{
	char path[PATH_SIZE], *end;
	struct gnp_buffer file = {0};
	gnp_status status = gnp_file_read(path_of(peers, SECONDS, path), &file, error);
	if (status == GNP_OK)
		status = gnp_buffer_append(&file, "", 1, error);
	if (status == GNP_OK) {
		const char *text = (const char *)file.data;
		double own = strtod(text, &end);
		if (end == text || !(own >= 0))
			status = gnp_error_set(error, GNP_UNAVAILABLE, "%s: printed '%.40s', need its seconds", peer->name, text);
		else
			*seconds += own;
	}
	gnp_buffer_clear(&file);
	return status;
}

gnp_status gnp_real_peers_run(const struct gnp_real_peers *peers, const struct gnp_real_peer *peer, const unsigned *k,
                              size_t count, double *normals, double *seconds, struct gnp_error *error)
{
	char program[PATH_SIZE], neighbors[128] = "", paths[3][PATH_SIZE];
	size_t length = 0;
	snprintf(program, sizeof program, "%s/%s", peers->folder, peer->program);
	for (size_t i = 0; i < count && length < sizeof neighbors; i++)
		length += (size_t)snprintf(neighbors + length, sizeof neighbors - length, "%s%u", i ? "," : "", k[i]);
	for (int file = CLOUD; file <= NORMALS; file++)
		path_of(peers, file, paths[file]);
	unlink(paths[NORMALS]);
	char method[16];
	snprintf(method, sizeof method, "%s", peer->method);
	char *const arguments[] = {program, method, neighbors, paths[CLOUD], paths[CENTRES], paths[NORMALS], NULL};
	int code = run_program(peers, arguments);
	if (code != 0)
		return gnp_error_set(error, GNP_UNAVAILABLE, "%s: %s ended with %d, need 0", peer->name, program, code);
	gnp_status status = take_normals(peers, peer, count, normals, error);
	return status == GNP_OK ? take_seconds(peers, peer, seconds, error) : status;
}
