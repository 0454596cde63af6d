/* How far a job is, and when it will be done. */
#include "job_progress.h"
#include "test.h"

static const struct gnpd_job_progress nothing = {.eta = -1};

static void begin_flow(struct gnp_task *task, size_t before)
{
	gnp_task_init(task);
	gnp_task_stage(task, GNP_STAGE_FLOW, 1000);
	if (before)
		gnp_task_skip(task, before);
}

static void what_an_earlier_run_did_says_nothing_of_the_pace(void)
{
	struct gnp_task fresh, resumed;
	begin_flow(&fresh, 0);
	begin_flow(&resumed, 800);
	struct gnpd_job_progress progress = gnpd_job_progress_of(&resumed, 1, &nothing);
	CHECK(progress.fraction > 0.75 && progress.step == 800 && progress.steps == 1000);
	gnp_task_advance(&fresh, 100);
	gnp_task_advance(&resumed, 100);
	double alone = gnpd_job_progress_of(&fresh, 100, &nothing).eta;
	progress = gnpd_job_progress_of(&resumed, 100, &nothing);
	/* 100 steps are 0.087 of the whole, and what comes before the steps 0.1: that much was done in 100 s. */
	CHECK_NEAR(alone, 435, 1);
	CHECK_NEAR(progress.eta, 62.6, 1); /* the last 100 steps and the end */
}

static void no_pace_is_told_of_too_little(void)
{
	struct gnp_task task;
	gnp_task_init(&task);
	gnp_task_stage(&task, GNP_STAGE_DECODE, 10);
	gnp_task_advance(&task, 10);
	CHECK(gnpd_job_progress_of(&task, 5, &nothing).eta < 0);
}

static void the_fraction_never_falls(void)
{
	struct gnp_task task;
	begin_flow(&task, 0);
	struct gnpd_job_progress before = {.fraction = 0.7, .eta = -1};
	CHECK(gnpd_job_progress_of(&task, 5, &before).fraction == 0.7);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(what_an_earlier_run_did_says_nothing_of_the_pace), TEST(no_pace_is_told_of_too_little), TEST(the_fraction_never_falls)};
	return RUN_TESTS(tests);
}
