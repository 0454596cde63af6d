/* Jobs of processes that died: which are suspected, run alone, and failed at last. */
#include "tests/unit/server/jobs/jobs_fixture.h"

/* The record of a job of a process that died while it ran. */
static void leave_running(const char *id, uint64_t attempts)
{
	struct gnpd_job_store store = {0};
	struct gnpd_job_found found = {0};
	CHECK(gnpd_job_store_open(config.jobs_dir, &store, NULL) == GNP_OK);
	CHECK(gnpd_job_store_scan(&store, &events, &found, NULL) == GNP_OK);
	for (size_t i = 0; i < found.count; i++) {
		if (strcmp(found.records[i].id, id) == 0) {
			found.records[i].state = GNPD_JOB_RUNNING;
			found.records[i].attempts = attempts;
			CHECK(gnpd_job_store_put_record(&store, &found.records[i], NULL) == GNP_OK);
		}
		gnpd_job_record_clear(&found.records[i]);
	}
	free(found.records);
	gnpd_job_store_close(&store);
}

/* Three long jobs, of which the process died in the runs of the first two; opens the table again. */
static void open_after_death(uint64_t attempts, struct gnpd_job *jobs[3])
{
	char ids[3][GNPD_JOB_ID + 1];
	config.job_runners = 3;
	make_folder();
	open_jobs();
	for (int i = 0; i < 3; i++) {
		struct gnpd_job *job = long_submitted();
		copy_id(job, ids[i]);
		gnpd_job_release(job);
	}
	close_jobs();
	for (int i = 0; i < 2; i++)
		leave_running(ids[i], attempts);
	open_jobs();
	for (int i = 0; i < 3; i++)
		jobs[i] = found(ids[i]);
}

static void close_after_death(struct gnpd_job *jobs[3])
{
	for (int i = 0; i < 3; i++)
		gnpd_job_release(jobs[i]);
	close_jobs();
	remove_folder();
	gnpd_config_defaults(&config);
}

static size_t suspects(void)
{
	struct gnpd_jobs_counts counts;
	gnpd_jobs_count(table, &counts);
	return counts.suspects;
}

/* Of those that ran when a process died, and ran again, all were blamed for its next death. */
static void suspected_jobs_run_one_at_a_time_and_before_others(void)
{
	struct gnpd_job *jobs[3];
	config.jobs_checkpoint_seconds = 1000;
	open_after_death(1, jobs);
	for (int i = 0; i < 3; i++) {
		enum gnpd_job_deletion what;
		reach(jobs[i], GNPD_JOB_RUNNING);
		usleep(50000);
		for (int j = i + 1; j < 3; j++)
			CHECK(state_of(jobs[j]) == GNPD_JOB_QUEUED);
		CHECK(suspects() == (i == 0 ? 2U : i == 1 ? 1U : 0U));
		CHECK(gnpd_jobs_delete(table, jobs[i], &what, NULL) == GNP_OK && what == GNPD_JOB_IS_BEING_CANCELLED);
	}
	reach(jobs[2], GNPD_JOB_CANCELLED);
	close_after_death(jobs);
}

static void a_suspected_job_that_waits_can_be_cancelled(void)
{
	struct gnpd_job *jobs[3];
	config.jobs_checkpoint_seconds = 1000;
	open_after_death(1, jobs);
	reach(jobs[0], GNPD_JOB_RUNNING);
	for (int i = 1; i >= 0; i--) {
		enum gnpd_job_deletion what;
		CHECK(gnpd_jobs_delete(table, jobs[i], &what, NULL) == GNP_OK);
		reach(jobs[i], GNPD_JOB_CANCELLED);
	}
	CHECK(suspects() == 0);
	reach(jobs[2], GNPD_JOB_RUNNING);
	close_after_death(jobs);
}

/* A long job that was hit twice by what it had no part in is not lost as long as it gets on. */
static void a_job_that_gets_further_is_not_suspected_any_more(void)
{
	struct gnpd_job *jobs[3];
	struct gnpd_job_view view;
	config.jobs_checkpoint_seconds = 0;
	config.jobs_attempts = 6;
	open_after_death(5, jobs);
	for (int i = 0; i < 3; i++) {
		reach(jobs[i], GNPD_JOB_RUNNING);
		for (int wait = 0; wait < 10000 && suspects(); wait++)
			usleep(1000);
		reach(jobs[i], GNPD_JOB_RUNNING);
		gnpd_job_look(jobs[i], &view);
		CHECK(view.record.attempts == 1);
	}
	CHECK(suspects() == 0);
	close_after_death(jobs);
}

static void a_job_a_process_died_of_twice_has_failed(void)
{
	struct gnpd_job *jobs[3];
	struct gnpd_job_view view;
	CHECK(config.jobs_attempts == 2);
	open_after_death(2, jobs);
	for (int i = 0; i < 2; i++) {
		gnpd_job_look(jobs[i], &view);
		CHECK(view.record.state == GNPD_JOB_FAILED && view.record.error == GNP_INTERNAL);
		CHECK_CONTAINS(view.record.error_text, "the process died 2 times while this job ran, at last with no other job beside it");
	}
	CHECK(files_with(".body") == 1);
	reach(jobs[2], GNPD_JOB_RUNNING);
	close_after_death(jobs);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(suspected_jobs_run_one_at_a_time_and_before_others), TEST(a_suspected_job_that_waits_can_be_cancelled),
	                                    TEST(a_job_that_gets_further_is_not_suspected_any_more), TEST(a_job_a_process_died_of_twice_has_failed)};
	return run_with_jobs(argc, argv, tests, sizeof tests / sizeof *tests);
}
