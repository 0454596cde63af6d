/* The Prometheus exposition: counts, cumulative buckets, well-formed lines, families declared once and before use. */
#include "tests/unit/test.h"

#include "core/base/version.h"
#include "proto/operation/operations.h"
#include "server/base/metrics.h"

static char *write_text(const struct gnpd_metrics *metrics)
{
	struct gnp_buffer buffer = {0};
	struct gnpd_queue_state state = {.waiting = 3, .running = 2, .bytes = 4096};
	CHECK(gnpd_metrics_write(metrics, &state, &(struct gnp_prepared_cache_state){.hits = 3}, 7, &buffer, NULL) == GNP_OK);
	CHECK(gnp_buffer_append(&buffer, "", 1, NULL) == GNP_OK);
	return (char *)buffer.data;
}

static void requests_are_counted_by_operation_and_code(void)
{
	struct gnpd_metrics metrics;
	uint64_t good, bad, nanoseconds;
	gnpd_metrics_init(&metrics);
	gnpd_metrics_request(&metrics, GNPD_LABEL_OPERATION, 200, 0.25);
	gnpd_metrics_request(&metrics, GNPD_LABEL_OPERATION, 200, 0.5);
	gnpd_metrics_request(&metrics, GNPD_LABEL_OPERATION, 400, 0.001);
	gnpd_metrics_request(&metrics, GNPD_LABEL_HEALTH, 777, 0.001);
	char *text = write_text(&metrics);
	CHECK_CONTAINS(text, "\ngnpd_requests_total{operation=\"estimate\",code=\"200\"} 2\n");
	CHECK_CONTAINS(text, "\ngnpd_requests_total{operation=\"estimate\",code=\"400\"} 1\n");
	CHECK_CONTAINS(text, "\ngnpd_requests_total{operation=\"health\",code=\"500\"} 1\n");
	free(text);
	gnpd_metrics_totals(&metrics, GNPD_LABEL_OPERATION, &good, &bad, &nanoseconds);
	CHECK(good == 2 && bad == 1 && nanoseconds == 751000000);
}

/* The table had a fixed number of rows: what came after them was counted as the first operation here, and as others there. */
static void every_operation_has_a_row_of_its_own(void)
{
	struct gnpd_metrics metrics;
	const struct gnp_operation *operation;
	uint64_t good, bad, nanoseconds;
	gnpd_metrics_init(&metrics);
	for (size_t i = 0; (operation = gnp_operation_at(i)) != NULL; i++) {
		CHECK(gnpd_metrics_label(operation) < GNPD_LABELS);
		gnpd_metrics_request(&metrics, gnpd_metrics_label(operation), 200, 0.25);
	}
	CHECK(GNPD_LABELS == GNPD_LABEL_OPERATION + GNP_OPERATIONS_MAX && !gnp_operation_at(GNP_OPERATIONS_MAX));
	char *text = write_text(&metrics);
	for (size_t i = 0; (operation = gnp_operation_at(i)) != NULL; i++) {
		char line[128];
		gnpd_metrics_totals(&metrics, gnpd_metrics_label(operation), &good, &bad, &nanoseconds);
		CHECK(good == 1 && bad == 0);
		snprintf(line, sizeof line, "\ngnpd_requests_total{operation=\"%s\",code=\"200\"} 1\n", operation->name);
		CHECK_CONTAINS(text, line);
	}
	free(text);
}

static void loads_of_weights_are_counted_by_result(void)
{
	struct gnpd_metrics metrics;
	gnpd_metrics_init(&metrics);
	atomic_fetch_add(&metrics.reloads[GNPD_RELOAD_OK], 3);
	atomic_fetch_add(&metrics.reloads[GNPD_RELOAD_FAILED], 2);
	atomic_store(&metrics.models, 8);
	char *text = write_text(&metrics);
	CHECK_CONTAINS(text, "\ngnpd_weights_reloads_total{result=\"ok\"} 3\n");
	CHECK_CONTAINS(text, "\ngnpd_weights_reloads_total{result=\"failed\"} 2\n");
	CHECK_CONTAINS(text, "\ngnpd_weights_models 8\n");
	free(text);
}

static void buckets_are_cumulative(void)
{
	struct gnpd_metrics metrics;
	gnpd_metrics_init(&metrics);
	gnpd_metrics_request(&metrics, GNPD_LABEL_OPERATION, 200, 0.001); /* on a bound: within it */
	gnpd_metrics_request(&metrics, GNPD_LABEL_OPERATION, 200, 0.3);
	gnpd_metrics_request(&metrics, GNPD_LABEL_OPERATION, 200, 1e6);
	char *text = write_text(&metrics);
	CHECK_CONTAINS(text, "gnpd_request_duration_seconds_bucket{operation=\"estimate\",le=\"0.001\"} 1\n");
	CHECK_CONTAINS(text, "gnpd_request_duration_seconds_bucket{operation=\"estimate\",le=\"0.25\"} 1\n");
	CHECK_CONTAINS(text, "gnpd_request_duration_seconds_bucket{operation=\"estimate\",le=\"0.5\"} 2\n");
	CHECK_CONTAINS(text, "gnpd_request_duration_seconds_bucket{operation=\"estimate\",le=\"60\"} 2\n");
	CHECK_CONTAINS(text, "gnpd_request_duration_seconds_bucket{operation=\"estimate\",le=\"+Inf\"} 3\n");
	CHECK_CONTAINS(text, "gnpd_request_duration_seconds_count{operation=\"estimate\"} 3\n");
	free(text);
}

static void reasons_and_gauges_appear(void)
{
	struct gnpd_metrics metrics;
	gnpd_metrics_init(&metrics);
	gnpd_metrics_reject(&metrics, GNPD_REJECT_QUEUE_COUNT);
	gnpd_metrics_cancel(&metrics, GNPD_CANCEL_CLIENT_GONE);
	metrics.build = "abc123-dirty";
	char *text = write_text(&metrics);
	CHECK_CONTAINS(text, "\ngnpd_rejected_total{reason=\"queue_count\"} 1\n");
	CHECK_CONTAINS(text, "\ngnpd_rejected_total{reason=\"slow_body\"} 0\n");
	CHECK_CONTAINS(text, "\ngnpd_cancelled_total{reason=\"client_gone\"} 1\n");
	CHECK_CONTAINS(text, "\ngnpd_queue_requests 3\n");
	CHECK_CONTAINS(text, "\ngnpd_queue_bytes 4096\n");
	CHECK_CONTAINS(text, "\ngnpd_running_requests 2\n");
	CHECK_CONTAINS(text, "\ngnpd_workers 7\n");
	CHECK_CONTAINS(text, "\ngnpd_prepared_cache_hits_total 3\n");
	CHECK_CONTAINS(text, "# HELP gnpd_operator_cache_hits_total Old name of gnpd_prepared_cache_hits_total.\n");
	CHECK_CONTAINS(text, "\ngnpd_operator_cache_hits_total 3\n");
	CHECK_CONTAINS(text, "gnpd_build_info{version=\"" GNP_VERSION "\",build=\"abc123-dirty\"} 1\n");
	free(text);
}

static void the_version_is_that_of_its_numbers(void)
{
	char text[32];
	snprintf(text, sizeof text, "%d.%d.%d", GNP_VERSION_MAJOR, GNP_VERSION_MINOR, GNP_VERSION_PATCH);
	CHECK_STRING(text, GNP_VERSION);
}

/* Every sample belongs to the family declared last, and no family is declared twice. */
static void exposition_is_well_formed(void)
{
	struct gnpd_metrics metrics;
	char *save = NULL, family[128] = "", seen[8192] = "|";
	gnpd_metrics_init(&metrics);
	char *text = write_text(&metrics);
	CHECK(text[strlen(text) - 1] == '\n');
	for (char *line = strtok_r(text, "\n", &save); line; line = strtok_r(NULL, "\n", &save)) {
		char name[128], type[32], tag[140];
		if (sscanf(line, "# TYPE %127s %31s", name, type) == 2) {
			CHECK_STRING(name, family);
			CHECK(!strcmp(type, "counter") == (strstr(name, "_total") != NULL));
		} else if (sscanf(line, "# HELP %127s", name) == 1) {
			strcpy(family, name);
			snprintf(tag, sizeof tag, "|%s|", name);
			CHECK(!strstr(seen, tag));
			strcat(seen, tag + 1);
		} else {
			const char *value = strrchr(line, ' ');
			char *end = NULL;
			CHECK(strncmp(line, family, strlen(family)) == 0 && strncmp(line, "gnpd_", 5) == 0);
			CHECK(value && (strtod(value, &end), end && *end == '\0'));
		}
	}
	free(text);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(requests_are_counted_by_operation_and_code), TEST(every_operation_has_a_row_of_its_own),
		TEST(loads_of_weights_are_counted_by_result),
		TEST(buckets_are_cumulative),
		TEST(reasons_and_gauges_appear),
		TEST(the_version_is_that_of_its_numbers),
		TEST(exposition_is_well_formed),
	};
	return RUN_TESTS(tests);
}
