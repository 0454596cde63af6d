/* Writes the metrics of jobs in Prometheus text form. */
#include "proto/tensor/writer.h"
#include "server/config/config.h"
#include "server/jobs/job.h"
#include "server/jobs/job_watch.h"
#include "server/work/engine.h"

static void put_family(struct gnp_writer *w, const char *name, const char *type, const char *help)
{
	gnp_writer_printf(w, "# HELP gnpd_jobs%s %s\n# TYPE gnpd_jobs%s %s\n", name, help, name, type);
}

static void put_states(struct gnp_writer *w, const struct gnpd_jobs_counts *counts)
{
	put_family(w, "", "gauge", "Jobs kept, by state.");
	for (int s = 0; s < GNPD_JOB_STATES; s++)
		gnp_writer_printf(w, "gnpd_jobs{state=\"%s\"} %zu\n", gnpd_job_state_name((enum gnpd_job_state)s), counts->states[s]);
	put_family(w, "_ended_total", "counter", "Jobs that came to this end.");
	for (int s = GNPD_JOB_SUCCEEDED; s < GNPD_JOB_STATES; s++)
		gnp_writer_printf(w, "gnpd_jobs_ended_total{state=\"%s\"} %llu\n", gnpd_job_state_name((enum gnpd_job_state)s),
		                  (unsigned long long)counts->ended[s]);
}

static void put_refused(struct gnp_writer *w, const struct gnpd_jobs_counts *counts)
{
	const struct {
		const char *name;
		uint64_t value;
	} reasons[] = {{"count", counts->refused_count}, {"queue", counts->refused_queue}, {"bytes", counts->refused_bytes},
	               {"disk", counts->refused_disk}, {"memory", counts->refused_memory}};
	put_family(w, "_refused_total", "counter", "What found no room in the store of jobs.");
	for (size_t i = 0; i < sizeof reasons / sizeof reasons[0]; i++)
		gnp_writer_printf(w, "gnpd_jobs_refused_total{reason=\"%s\"} %llu\n", reasons[i].name, (unsigned long long)reasons[i].value);
}

gnp_status gnpd_jobs_metrics_write(struct gnpd_jobs *jobs, struct gnp_buffer *buffer, struct gnp_error *error)
{
	const struct gnpd_config *config = jobs->engine->config;
	struct gnpd_jobs_counts counts;
	gnpd_jobs_count(jobs, &counts);
	const struct {
		const char *name, *type, *help;
		double value;
	} singles[] = {
		{"_submitted_total", "counter", "Jobs acknowledged.", (double)counts.submitted},
		{"_replayed_total", "counter", "Requests answered with the job their Idempotency-Key had made.", (double)counts.replayed},
		{"_recovered_total", "counter", "Jobs taken up from an earlier process.", (double)counts.recovered},
		{"_damaged_total", "counter", "Records that could not be read and were set aside.", (double)counts.damaged},
		{"_checkpoints_total", "counter", "Checkpoints written.", (double)counts.checkpoints},
		{"_resumed_total", "counter", "Runs that went on from a checkpoint.", (double)counts.resumed},
		{"_suspects", "gauge", "Jobs that ran when a process died and have not got further since.", (double)counts.suspects},
		{"_bytes", "gauge", "Bytes of bodies, checkpoints and results kept.", (double)counts.bytes},
		{"_memory_bytes", "gauge", "Memory held by jobs that run.", (double)counts.memory},
		{"_memory_bytes_limit", "gauge", "Most memory of them.", (double)gnpd_jobs_memory_most(jobs)},
		{"_watches", "gauge", "Requests that wait for a job to change.", (double)gnpd_watchers_count(jobs->watchers)},
		{"_limit", "gauge", "Most jobs kept.", (double)config->jobs_count},
		{"_bytes_limit", "gauge", "Most bytes of them.", (double)config->jobs_bytes},
		{"_queue_limit", "gauge", "Most jobs that may wait.", (double)config->jobs_queue_count},
		{"_watches_limit", "gauge", "Most requests that may wait for a job to change.", (double)config->jobs_watch_count},
		{"_runners", "gauge", "Jobs that may run at once.", (double)config->job_runners},
		{"_attempts_limit", "gauge", "Deaths of the process while a job runs, after which it has failed.", (double)config->jobs_attempts},
		{"_ttl_seconds", "gauge", "How long jobs that are over are kept.", config->jobs_ttl_seconds},
		{"_seconds_limit", "gauge", "Most seconds of a run.", config->jobs_seconds},
		{"_wait_seconds_limit", "gauge", "Most seconds of a long poll.", config->jobs_wait_seconds},
	};
	struct gnp_writer w = gnp_writer_to(buffer, error);
	put_states(&w, &counts);
	put_refused(&w, &counts);
	for (size_t i = 0; i < sizeof singles / sizeof singles[0]; i++) {
		put_family(&w, singles[i].name, singles[i].type, singles[i].help);
		gnp_writer_printf(&w, "gnpd_jobs%s %.15g\n", singles[i].name, singles[i].value);
	}
	return w.status;
}
