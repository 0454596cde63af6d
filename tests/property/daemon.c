#include "tests/property/daemon.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

static pid_t daemon_pid;
static bool died;

static bool runs(void)
{
	int status;
	return daemon_pid > 0 && waitpid(daemon_pid, &status, WNOHANG) == 0;
}

static int read_port(const char *path)
{
	int port = 0;
	for (int i = 0; i < 3000 && port == 0; i++) {
		FILE *file = fopen(path, "r");
		if (file && fscanf(file, "%d", &port) != 1)
			port = 0;
		if (file)
			fclose(file);
		if (!port)
			usleep(10000);
	}
	return port;
}

static void start(const char *program, const char *weights, char *url, size_t size)
{
	char folder[] = "/tmp/gnpd-property.XXXXXX", path[80];
	if (!mkdtemp(folder))
		return;
	snprintf(path, sizeof path, "%s/port", folder);
	daemon_pid = fork();
	if (daemon_pid == 0) {
		execl(program, program, "--listen", "127.0.0.1:0", "--port-file", path, "--weights-dir", weights, "--log-level", "error", (char *)NULL);
		_exit(127);
	}
	snprintf(url, size, "http://127.0.0.1:%d", read_port(path));
	unlink(path);
	rmdir(folder);
}

void daemon_watch(const char *program, const char *weights, char *url, size_t size)
{
	if (!program[0] || runs())
		return;
	if (daemon_pid > 0) {
		printf("the daemon died\n");
		died = true;
	}
	start(program, weights, url, size);
}

bool daemon_stop(void)
{
	int status = 0;
	if (daemon_pid <= 0)
		return true;
	bool alive = runs();
	if (alive)
		kill(daemon_pid, SIGTERM);
	if (alive && waitpid(daemon_pid, &status, 0) == daemon_pid && status == 0)
		return !died;
	printf("the daemon did not end well: status %d\n", status);
	return false;
}
