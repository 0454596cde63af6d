#include "core/base/task.h"

#include <time.h>

#include "tests/unit/test.h"

static void pause_for(double seconds)
{
	struct timespec time = {0, (long)(1e9 * seconds)};
	nanosleep(&time, NULL);
}

static void what_stops_a_task_stops_its_parts(void)
{
	struct gnp_task whole, part, smaller;
	struct gnp_error error = {0};
	gnp_task_init(&whole);
	gnp_task_init_part(&part, &whole);
	gnp_task_init_part(&smaller, &part);
	CHECK(gnp_task_check(&smaller, &error) == GNP_OK && error.status == GNP_OK);
	gnp_task_stop(&whole, GNP_DEADLINE);
	CHECK(gnp_task_check(&smaller, &error) == GNP_DEADLINE);
	CHECK_STRING(error.text, gnp_status_text(GNP_DEADLINE));
	gnp_task_init(&whole);
	gnp_task_cancel(&part);
	CHECK(gnp_task_check(&whole, NULL) == GNP_OK && gnp_task_check(&smaller, NULL) == GNP_CANCELLED);
	gnp_task_init_part(&part, NULL);
	CHECK(gnp_task_check(&part, NULL) == GNP_OK && gnp_task_check(NULL, NULL) == GNP_OK);
}

/* Progress of a part is its own; its seconds are booked once, and add up with the rest of the stage. */
static void seconds_of_parts_are_booked_on_their_stages(void)
{
	struct gnp_task whole, part;
	gnp_task_init(&whole);
	gnp_task_stage(&whole, GNP_STAGE_FLOW, 4);
	double begun = whole.started;
	gnp_task_advance(&whole, 1);
	gnp_task_init_part(&part, &whole);
	gnp_task_stage(&part, GNP_STAGE_ESTIMATE, 10);
	gnp_task_advance(&part, 10);
	pause_for(0.02);
	gnp_task_stage(&part, GNP_STAGE_DONE, 0);
	CHECK(gnp_task_fraction(&whole) == 0.25 && gnp_task_current(&whole) == GNP_STAGE_FLOW);
	gnp_task_book_part(&whole, &part);
	gnp_task_book_part(NULL, &part);
	pause_for(0.01);
	gnp_task_stage(&whole, GNP_STAGE_DONE, 0);
	double all = whole.started - begun;
	CHECK(whole.seconds[GNP_STAGE_ESTIMATE] >= 0.02 && whole.seconds[GNP_STAGE_FLOW] >= 0.009);
	CHECK_NEAR(whole.seconds[GNP_STAGE_ESTIMATE] + whole.seconds[GNP_STAGE_FLOW], all, 1e-9);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(what_stops_a_task_stops_its_parts), TEST(seconds_of_parts_are_booked_on_their_stages)};
	return RUN_TESTS(tests);
}
