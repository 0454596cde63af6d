/* What the service manager hears and hands over. */
#include "tests/unit/test.h"

#include <fcntl.h>
#include <netinet/in.h>
#include <stddef.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "server/base/inherit.h"
#include "server/base/notify.h"

static struct gnp_error error;

/* A manager's socket under an abstract name, which goes with it. */
static int manager(char *name)
{
	struct sockaddr_un address = {.sun_family = AF_UNIX};
	sprintf(name, "@gnpd-test-notify-%d", (int)getpid());
	size_t length = strlen(name);
	memcpy(address.sun_path + 1, name + 1, length - 1);
	int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0);
	CHECK(bind(fd, (struct sockaddr *)&address, (socklen_t)(offsetof(struct sockaddr_un, sun_path) + length)) == 0);
	return fd;
}

static const char *hear(int fd)
{
	static char text[512];
	ssize_t size = recv(fd, text, sizeof text - 1, 0);
	text[size < 0 ? 0 : size] = '\0';
	return text;
}

static void messages_have_the_form_of_sd_notify(void)
{
	char name[64], pid[32];
	struct gnpd_notify *notify = NULL;
	int fd = manager(name);
	sprintf(pid, "%d", (int)getpid());
	CHECK(gnpd_notify_create(name, "3000000", pid, &notify, NULL) == GNP_OK && notify);
	gnpd_notify_ready(notify);
	CHECK_STRING(hear(fd), "READY=1\nSTATUS=ready");
	gnpd_notify_reloading(notify);
	CHECK_CONTAINS(hear(fd), "RELOADING=1\nMONOTONIC_USEC=");
	gnpd_notify_stopping(notify, 1.5);
	CHECK_STRING(hear(fd), "STOPPING=1\nEXTEND_TIMEOUT_USEC=1500000\nSTATUS=draining");
	gnpd_notify_alive(notify);
	CHECK_STRING(hear(fd), "WATCHDOG=1");
	gnpd_notify_status(notify, "%d things\nREADY=1", 3);
	CHECK_STRING(hear(fd), "STATUS=3 things");
	CHECK_NEAR(gnpd_notify_interval(notify), 1.5, 0);
	CHECK(gnpd_notify_due(notify, 100) && !gnpd_notify_due(notify, 101) && gnpd_notify_due(notify, 101.5));
	gnpd_notify_free(notify);
	close(fd);
}

static void a_watchdog_of_another_process_is_none(void)
{
	char name[64];
	struct gnpd_notify *notify = NULL;
	int fd = manager(name);
	static const char *const values[][2] = {{"3000000", "1"}, {NULL, NULL}, {"0", NULL}, {"x", NULL}, {"-5", NULL}};
	for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
		CHECK(gnpd_notify_create(name, values[i][0], values[i][1], &notify, NULL) == GNP_OK);
		gnpd_notify_alive(notify);
		CHECK_STRING(hear(fd), "");
		CHECK_NEAR(gnpd_notify_interval(notify), 5, 0); /* the line for people still comes */
		gnpd_notify_free(notify);
	}
	close(fd);
}

static void without_a_manager_nothing_happens(void)
{
	struct gnpd_notify *notify = (struct gnpd_notify *)&error;
	CHECK(gnpd_notify_create(NULL, "1000", NULL, &notify, NULL) == GNP_OK && !notify);
	gnpd_notify_ready(notify);
	gnpd_notify_status(notify, "x");
	CHECK(gnpd_notify_interval(notify) == 0 && !gnpd_notify_due(notify, 1));
	gnpd_notify_free(notify);
	char longer[256];
	memset(longer, 'x', sizeof longer - 1);
	longer[0] = '/';
	longer[sizeof longer - 1] = '\0';
	const char *const bad[] = {"relative", "@", longer};
	for (size_t i = 0; i < 3; i++) {
		error = (struct gnp_error){0};
		CHECK(gnpd_notify_create(bad[i], NULL, NULL, &notify, &error) == GNP_INVALID_ARGUMENT);
		CHECK_CONTAINS(error.text, "NOTIFY_SOCKET: got \"");
	}
}

/* A listening socket at a descriptor of our choice. */
static void listen_at(int fd)
{
	struct sockaddr_in address = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
	int s = socket(AF_INET, SOCK_STREAM, 0);
	CHECK(bind(s, (struct sockaddr *)&address, sizeof address) == 0 && listen(s, 1) == 0 && dup2(s, fd) == fd);
	close(s);
}

static void sockets_go_by_their_names(void)
{
	enum { FIRST = 200 };
	char pid[32];
	struct gnpd_inherited got;
	sprintf(pid, "%d", (int)getpid());
	listen_at(FIRST);
	listen_at(FIRST + 1);
	CHECK(gnpd_inherit(pid, "2", "admin:http", FIRST, &got, NULL) == GNP_OK && got.admin == FIRST && got.main == FIRST + 1);
	CHECK((fcntl(FIRST, F_GETFL) & O_NONBLOCK) && (fcntl(FIRST, F_GETFD) & FD_CLOEXEC));
	close(FIRST + 1);
	CHECK(gnpd_inherit(pid, "1", NULL, FIRST, &got, NULL) == GNP_OK && got.main == FIRST && got.admin == -1);
	CHECK(gnpd_inherit("1", "1", NULL, FIRST, &got, NULL) == GNP_OK && got.main == -1 && got.admin == -1);
	CHECK(gnpd_inherit(NULL, "1", NULL, FIRST, &got, NULL) == GNP_OK && got.main == -1);
	static const char *const bad[] = {"", "x", "-1", "99", "1x"};
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
		CHECK(gnpd_inherit(pid, bad[i], NULL, FIRST, &got, NULL) == GNP_INVALID_ARGUMENT);
	listen_at(FIRST + 1);
	error = (struct gnp_error){0};
	CHECK(gnpd_inherit(pid, "2", "a:b", FIRST, &got, &error) == GNP_INVALID_ARGUMENT && got.main == -1);
	CHECK_STRING(error.text, "LISTEN_FDS: got two sockets for the main listener, need at most 1");
	CHECK(fcntl(FIRST, F_GETFD) == -1 && fcntl(FIRST + 1, F_GETFD) == -1); /* closed */
	error = (struct gnp_error){0};
	CHECK(gnpd_inherit(pid, "1", "adm", FIRST, &got, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "LISTEN_FDS: descriptor 200 (\"adm\"): not a listening stream socket");
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(messages_have_the_form_of_sd_notify),
		TEST(a_watchdog_of_another_process_is_none),
		TEST(without_a_manager_nothing_happens),
		TEST(sockets_go_by_their_names),
	};
	return RUN_TESTS(tests);
}
