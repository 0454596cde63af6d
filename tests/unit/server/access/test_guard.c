/* The guard: token buckets by the clock, limits of a key, and keys that are swapped while threads use them. */
#include "tests/unit/test.h"

#include <pthread.h>
#include <stdatomic.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/base/task.h"
#include "server/access/bucket.h"
#include "server/access/guard.h"

#define ALICE "sha256:2bd806c97f0e00af1a1fc3328fa763a9269723c8db8fac4f93af71db186d6e90"
#define BOB "sha256:81b637d8fcd2c6da6359e6963113a1170de795e4b725b84d1e0b4cfd9ec58ce9"

static char path[64];
static struct gnp_error error;

static void write_keys(const char *text)
{
	char beside[80];
	snprintf(beside, sizeof beside, "%s.new", path);
	FILE *file = fopen(beside, "w");
	CHECK(file && fputs(text, file) >= 0 && fclose(file) == 0 && chmod(beside, 0600) == 0 && rename(beside, path) == 0);
}

static struct gnpd_guard *open_guard(const char *text)
{
	struct gnpd_guard *guard = NULL;
	strcpy(path, "/tmp/test_guard.XXXXXX");
	close(mkstemp(path));
	write_keys(text);
	CHECK(gnpd_guard_create(path, &guard, NULL) == GNP_OK && gnpd_guard_on(guard));
	return guard;
}

static void close_guard(struct gnpd_guard *guard)
{
	gnpd_guard_free(guard);
	unlink(path);
}

static struct gnpd_principal *identify(struct gnpd_guard *guard, const char *secret, unsigned *scopes)
{
	struct gnpd_principal *principal = NULL;
	error = (struct gnp_error){0};
	gnpd_guard_identify(guard, &(struct gnpd_credentials){NULL, secret, 0, 1}, &principal, scopes, &error);
	return principal;
}

static bool enter(struct gnpd_principal *principal, double now, enum gnpd_limit *limit, double *wait)
{
	error = (struct gnp_error){0};
	return gnpd_principal_enter(principal, now, limit, wait, &error) == GNP_OK;
}

static void buckets_hold_a_burst_and_fill_at_their_rate(void)
{
	struct gnpd_bucket bucket;
	gnpd_bucket_init(&bucket, 3, 100);
	for (int i = 0; i < 3; i++)
		CHECK(gnpd_bucket_take(&bucket, 2, 3, 100) == 0);
	CHECK_NEAR(gnpd_bucket_take(&bucket, 2, 3, 100), 0.5, 1e-12);
	CHECK_NEAR(gnpd_bucket_take(&bucket, 2, 3, 100.25), 0.25, 1e-12);
	CHECK_NEAR(gnpd_bucket_take(&bucket, 2, 3, 99), 0.25, 1e-12); /* a step back adds and takes nothing */
	CHECK(gnpd_bucket_take(&bucket, 2, 3, 100.5) == 0);
	CHECK(gnpd_bucket_take(&bucket, 2, 3, 1e9) == 0);
	CHECK(gnpd_bucket_take(&bucket, 2, 3, 1e9) == 0);
	CHECK(gnpd_bucket_take(&bucket, 2, 3, 1e9) == 0);
	CHECK(gnpd_bucket_take(&bucket, 2, 3, 1e9) > 0); /* never more than the burst */
	CHECK(gnpd_bucket_take(&bucket, 2, 1, 2e9) == 0);
	CHECK(gnpd_bucket_take(&bucket, 2, 1, 2e9) > 0); /* a smaller burst holds at once */
}

static void keys_lead_to_their_names(void)
{
	struct gnpd_guard *guard = open_guard("a " ALICE " infer\nb " BOB " admin,jobs\n");
	unsigned scopes = 0;
	struct gnpd_principal *alice = identify(guard, "alice", &scopes);
	CHECK(alice && scopes == 1u << GNPD_SCOPE_INFER);
	CHECK_STRING(gnpd_principal_name(alice), "a");
	struct gnpd_principal *bob = identify(guard, "bob", &scopes);
	CHECK(bob && scopes == (1u << GNPD_SCOPE_ADMIN | 1u << GNPD_SCOPE_JOBS));
	CHECK(!identify(guard, "carol", &scopes) && error.status == GNP_UNAUTHORIZED);
	CHECK_STRING(error.text, "the key is not known");
	gnpd_principal_release(alice);
	gnpd_principal_release(bob);
	CHECK(gnpd_guard_count(guard) == 2);
	close_guard(guard);
}

static void limits_refuse_and_say_which(void)
{
	struct gnpd_guard *guard = open_guard("a " ALICE " infer concurrency=2 rate=1/s burst=3\n");
	unsigned scopes;
	enum gnpd_limit limit;
	double wait, now = gnp_clock();
	struct gnpd_principal *alice = identify(guard, "alice", &scopes);
	CHECK(enter(alice, now, &limit, &wait) && enter(alice, now, &limit, &wait));
	CHECK(!enter(alice, now, &limit, &wait) && limit == GNPD_LIMIT_CONCURRENCY && wait == 0);
	CHECK_STRING(error.text, "key a: 2 requests are under way, at most 2 may be (concurrency)");
	gnpd_principal_leave(alice);
	CHECK(enter(alice, now, &limit, &wait)); /* what the concurrency refused cost no token */
	gnpd_principal_leave(alice);
	CHECK(!enter(alice, now, &limit, &wait) && limit == GNPD_LIMIT_RATE && wait > 0.5 && wait <= 1);
	CHECK_CONTAINS(error.text, "key a: over 1 requests a second after 3 at once (rate, burst)");
	CHECK(error.status == GNP_LIMITED);
	CHECK(enter(alice, now + wait, &limit, &wait));
	gnpd_principal_leave(alice);
	gnpd_principal_leave(alice);
	gnpd_principal_release(alice);
	close_guard(guard);
}

static void names_that_stay_keep_their_counts(void)
{
	struct gnpd_guard *guard = open_guard("a " ALICE " infer concurrency=2\nb " BOB " infer\n");
	struct gnp_buffer text = {0};
	unsigned scopes;
	enum gnpd_limit limit;
	double wait;
	struct gnpd_principal *alice = identify(guard, "alice", &scopes), *bob = identify(guard, "bob", &scopes);
	CHECK(enter(alice, 0, &limit, &wait) && enter(bob, 0, &limit, &wait));
	gnpd_principal_count(alice, 200, 7);
	write_keys("a " BOB " admin concurrency=1\n");
	CHECK(gnpd_guard_reload(guard, NULL) == GNP_OK);
	struct gnpd_principal *again = identify(guard, "bob", &scopes);
	CHECK(again == alice && scopes == 1u << GNPD_SCOPE_ADMIN);
	CHECK(!identify(guard, "alice", &scopes));
	CHECK(!enter(again, 0, &limit, &wait)); /* the one under way counts under the new limit */
	gnpd_principal_leave(bob); /* a name that is gone lives as long as its requests */
	gnpd_principal_release(bob);
	CHECK(gnpd_guard_write(guard, &text, NULL) == GNP_OK && gnp_buffer_append(&text, "", 1, NULL) == GNP_OK);
	CHECK_CONTAINS((char *)text.data, "gnpd_principal_requests_total{principal=\"a\",class=\"2xx\"} 1\n");
	CHECK_CONTAINS((char *)text.data, "gnpd_principal_points_total{principal=\"a\"} 7\n");
	CHECK_CONTAINS((char *)text.data, "gnpd_principal_active_requests{principal=\"a\"} 1\n");
	CHECK_CONTAINS((char *)text.data, "gnpd_principal_limited_total{principal=\"a\",limit=\"concurrency\"} 1\n");
	CHECK(!strstr((char *)text.data, "principal=\"b\""));
	gnp_buffer_clear(&text);
	write_keys("nonsense\n");
	error = (struct gnp_error){0};
	CHECK(gnpd_guard_reload(guard, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "line 1: need NAME");
	CHECK(gnpd_guard_count(guard) == 1);
	gnpd_principal_leave(alice);
	gnpd_principal_release(alice);
	gnpd_principal_release(again);
	close_guard(guard);
}

struct asking {
	struct gnpd_guard *guard;
	atomic_bool halt;
	atomic_size_t found, lost;
};

static void *ask(void *context)
{
	struct asking *asking = context;
	unsigned scopes;
	enum gnpd_limit limit;
	double wait;
	while (!atomic_load(&asking->halt)) {
		struct gnpd_principal *principal = NULL;
		if (gnpd_guard_identify(asking->guard, &(struct gnpd_credentials){NULL, "alice", 0, 1}, &principal, &scopes, NULL) != GNP_OK) {
			atomic_fetch_add(&asking->lost, 1);
			continue;
		}
		if (gnpd_principal_enter(principal, gnp_clock(), &limit, &wait, NULL) == GNP_OK)
			gnpd_principal_leave(principal);
		gnpd_principal_count(principal, 200, 1);
		gnpd_principal_release(principal);
		atomic_fetch_add(&asking->found, 1);
	}
	return NULL;
}

static void keys_are_swapped_under_those_who_ask(void)
{
	struct asking asking = {.guard = open_guard("a " ALICE " infer\n")};
	pthread_t threads[3];
	for (int i = 0; i < 3; i++)
		pthread_create(&threads[i], NULL, ask, &asking);
	while (atomic_load(&asking.found) < 3)
		usleep(100);
	for (int i = 0; i < 100; i++) {
		write_keys(i % 2 ? "a " ALICE " infer\n" : "b " BOB " infer\na " ALICE " jobs rate=1000/s concurrency=2\n");
		CHECK(gnpd_guard_reload(asking.guard, NULL) == GNP_OK);
	}
	atomic_store(&asking.halt, true);
	for (int i = 0; i < 3; i++)
		pthread_join(threads[i], NULL);
	CHECK(atomic_load(&asking.lost) == 0);
	close_guard(asking.guard);
}

static void without_a_file_nobody_is_asked(void)
{
	struct gnpd_guard *guard = NULL;
	struct gnp_buffer text = {0};
	CHECK(gnpd_guard_create("", &guard, NULL) == GNP_OK);
	CHECK(!gnpd_guard_on(guard) && gnpd_guard_reload(guard, NULL) == GNP_OK && gnpd_guard_count(guard) == 0);
	CHECK(gnpd_guard_write(guard, &text, NULL) == GNP_OK && text.size == 0);
	gnpd_guard_free(guard);
	guard = NULL;
	CHECK(gnpd_guard_create("/nonexistent/keys", &guard, NULL) == GNP_IO && !guard);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(buckets_hold_a_burst_and_fill_at_their_rate),
		TEST(keys_lead_to_their_names),
		TEST(limits_refuse_and_say_which),
		TEST(names_that_stay_keep_their_counts),
		TEST(keys_are_swapped_under_those_who_ask),
		TEST(without_a_file_nobody_is_asked),
	};
	return RUN_TESTS(tests);
}
