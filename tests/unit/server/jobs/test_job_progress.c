/* How far a job is, and when it will be done. */
#include "server/jobs/job_progress.h"
#include "tests/unit/test.h"

static const struct gnpd_job_progress nothing = {.eta = -1};

static void begin_flow(struct gnp_task *task)
{
	gnp_task_init(task);
	gnp_task_stage(task, GNP_STAGE_FLOW, 1000);
}

/* The stages before the steps, a tenth of the whole by its share, were taken for a tenth of the time: of a flow that takes 24 s in all
 * it was said after one that 7 were left. */
static void steps_are_as_long_as_those_before_them(void)
{
	struct gnp_task task;
	gnp_task_init(&task);
	gnp_task_stage(&task, GNP_STAGE_PREPARE, 10);
	gnp_task_advance(&task, 10);
	struct gnpd_job_progress progress = gnpd_job_progress_of(&task, 0.1, &nothing);
	CHECK(progress.eta < 0);
	gnp_task_stage(&task, GNP_STAGE_FLOW, 400);
	progress = gnpd_job_progress_of(&task, 0.2, &progress);
	CHECK(progress.eta < 0 && progress.steps == 400);
	gnp_task_advance(&task, 1);
	progress = gnpd_job_progress_of(&task, 0.26, &progress);
	CHECK_NEAR(progress.eta, 0.06 * 399, 1e-9);
	gnp_task_advance(&task, 99);
	progress = gnpd_job_progress_of(&task, 6.2, &progress);
	CHECK_NEAR(progress.eta, 18, 1e-9);
	gnp_task_advance(&task, 300);
	CHECK_NEAR(gnpd_job_progress_of(&task, 24.2, &progress).eta, 0, 1e-9);
}

static void what_an_earlier_run_did_says_nothing_of_the_pace(void)
{
	struct gnp_task task;
	gnp_task_init(&task);
	gnp_task_stage(&task, GNP_STAGE_FLOW, 1000); /* seen before the steps of the earlier run are booked */
	struct gnpd_job_progress progress = gnpd_job_progress_of(&task, 1, &nothing);
	gnp_task_skip(&task, 800);
	progress = gnpd_job_progress_of(&task, 1.5, &progress);
	CHECK(progress.fraction > 0.75 && progress.step == 800 && progress.steps == 1000 && progress.eta < 0);
	gnp_task_advance(&task, 100);
	CHECK_NEAR(gnpd_job_progress_of(&task, 101, &progress).eta, 100, 1e-9);
}

static void no_pace_is_told_of_too_little(void)
{
	struct gnp_task task;
	gnp_task_init(&task);
	gnp_task_stage(&task, GNP_STAGE_DECODE, 10);
	gnp_task_advance(&task, 10);
	CHECK(gnpd_job_progress_of(&task, 5, &nothing).eta < 0);
}

static void work_that_has_no_steps_goes_by_its_share(void)
{
	struct gnp_task task;
	gnp_task_init(&task);
	gnp_task_stage(&task, GNP_STAGE_ESTIMATE, 100);
	gnp_task_advance(&task, 50);
	struct gnpd_job_progress progress = gnpd_job_progress_of(&task, 5, &nothing);
	CHECK_NEAR(progress.fraction, 0.5, 1e-9);
	CHECK_NEAR(progress.eta, 5, 1e-9);
}

static void the_fraction_never_falls(void)
{
	struct gnp_task task;
	begin_flow(&task);
	struct gnpd_job_progress before = {.fraction = 0.7, .eta = -1};
	CHECK(gnpd_job_progress_of(&task, 5, &before).fraction == 0.7);
}

/* It fell back to nothing. */
static void what_was_stopped_stays_where_it_was(void)
{
	struct gnp_task task;
	begin_flow(&task);
	gnp_task_advance(&task, 250);
	struct gnpd_job_progress before = gnpd_job_progress_of(&task, 5, &nothing);
	gnp_task_cancel(&task);
	gnp_task_stage(&task, GNP_STAGE_ENCODE, 0);
	struct gnpd_job_progress after = gnpd_job_progress_of(&task, 6, &before);
	CHECK_STRING(after.stage, "flow");
	CHECK(after.step == 250 && after.steps == 1000 && after.fraction == before.fraction && after.eta < 0);
	begin_flow(&task);
	gnp_task_stage(&task, GNP_STAGE_DONE, 0); /* what failed passes this way */
	after = gnpd_job_progress_of(&task, 6, &before);
	CHECK_STRING(after.stage, "flow");
	CHECK(after.step == 250 && after.fraction == before.fraction);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(steps_are_as_long_as_those_before_them), TEST(what_an_earlier_run_did_says_nothing_of_the_pace),
		TEST(no_pace_is_told_of_too_little),          TEST(work_that_has_no_steps_goes_by_its_share),
		TEST(the_fraction_never_falls),               TEST(what_was_stopped_stays_where_it_was),
	};
	return RUN_TESTS(tests);
}
