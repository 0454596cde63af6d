/* property: requests drawn from the table of operations, over clouds as they should not be, each judged by what must be true of any answer.
 *
 *   property [--seed S] [--draws N | --minutes M] [--weights DIR] [--gnpd PROGRAM] [--jobs J] [--lines FILE] [--show]
 *                                                                                               draws, and shrinks what fails
 *   property [--weights DIR] [--gnpd PROGRAM] 'op=... cloud=... n=...'                           runs one line
 *
 * Trials run in child processes: one that crashes or hangs is a finding like any other. */
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>
#include <fcntl.h>

#include "core/linear/blas_environment.h"
#include "core/linear/linalg.h"
#include "tests/property/daemon.h"
#include "tests/property/trial.h"

enum { JOBS_MAX = 8, MODELS_MAX = 32, HANGS = 240, EXIT_FINDING = 3 };

/* Memory that parents and children share. */
struct slot {
	char line[SPEC_TEXT], text[JUDGE_TEXT];
	atomic_int busy;
};

struct shared {
	atomic_ullong next;
	atomic_ullong outcome[4];
	struct slot slot[JOBS_MAX];
	char url[80];
};

struct settings {
	uint64_t seed, draws;
	double minutes, seconds;
	const char *weights, *gnpd, *line, *lines; /* lines: a file of those that failed once */
	unsigned jobs;
	bool show; /* every line with what came of it */
};

static struct shared *shared;
static struct gnp_models *models;
static const char *names[MODELS_MAX + 1];
static double end;

/* ---- Children ---- */

static void child_open(struct trial_bench *bench, const struct settings *settings)
{
	gnp_linalg_init();
	if (!trial_open(bench, models, shared->url, settings->seconds))
		_exit(1);
}

static enum trial_outcome try_line(struct trial_bench *bench, const struct spec *spec, struct slot *slot)
{
	spec_write(spec, slot->line);
	atomic_store(&slot->busy, 1);
	alarm(HANGS);
	enum trial_outcome outcome = trial_run(bench, spec, slot->text);
	alarm(0);
	return outcome;
}

/* Draws until the last one, or a finding. */
static void child_draw(const struct settings *settings, struct slot *slot)
{
	struct trial_bench bench;
	struct spec spec;
	child_open(&bench, settings);
	while (settings->minutes ? gnp_clock() < end : true) {
		unsigned long long index = atomic_fetch_add(&shared->next, 1);
		if (!settings->minutes && index >= settings->draws)
			break;
		spec_draw(settings->seed, index, names, &spec);
		enum trial_outcome outcome = try_line(&bench, &spec, slot);
		atomic_fetch_add(&shared->outcome[outcome], 1);
		if (settings->show)
			printf("%s | %s\n", slot->line, outcome == TRIAL_ANSWERED ? "answered" : outcome == TRIAL_TOO_LONG ? "not waited for" : slot->text);
		if (outcome == TRIAL_FAILED)
			_exit(EXIT_FINDING);
		atomic_store(&slot->busy, 0);
	}
	trial_close(&bench);
	exit(0); /* leaks are looked for */
}

/* ---- Findings ---- */

static const char *verdict(int status, const struct slot *slot)
{
	static char text[JUDGE_TEXT + 64];
	if (WIFEXITED(status) && WEXITSTATUS(status) == EXIT_FINDING)
		return slot->text;
	if (WIFSIGNALED(status))
		snprintf(text, sizeof text, "%s", WTERMSIG(status) == SIGALRM ? "hangs" : strsignal(WTERMSIG(status)));
	else
		snprintf(text, sizeof text, "died with status %d", WEXITSTATUS(status));
	return text;
}

/* Whether a line fails, in a child of its own. quiet: what the child says on standard error is not shown. */
static bool fails(const struct settings *settings, const struct spec *spec, bool quiet, struct slot *slot, int *status)
{
	daemon_watch(settings->gnpd, settings->weights, shared->url, sizeof shared->url);
	fflush(stdout);
	pid_t child = fork();
	if (child == 0) {
		struct trial_bench bench;
		if (quiet)
			dup2(open("/dev/null", O_WRONLY | O_CLOEXEC), STDERR_FILENO);
		child_open(&bench, settings);
		enum trial_outcome outcome = try_line(&bench, spec, slot);
		trial_close(&bench);
		exit(outcome == TRIAL_FAILED ? EXIT_FINDING : 0);
	}
	return child > 0 && waitpid(child, status, 0) == child && *status != 0;
}

/* Smaller lines that still fail: without a word, with fewer points. */
static void shrink(const struct settings *settings, struct spec *spec, struct slot *slot)
{
	enum { ATTEMPTS = 150 };
	int attempts = 0, status;
	for (bool smaller = true; smaller && attempts < ATTEMPTS;) {
		smaller = false;
		for (size_t i = 0; i < spec->count && attempts < ATTEMPTS; i++) {
			struct spec less = *spec;
			if (strcmp(spec->word[i].name, "op") == 0 || strcmp(spec->word[i].name, "n") == 0)
				continue;
			spec_set(&less, spec->word[i].name, NULL);
			attempts++;
			if (fails(settings, &less, true, slot, &status))
				*spec = less, smaller = true, i--;
		}
		double n = spec_number(spec, "n", 100), fewer[] = {n / 4, n / 2, n * 0.8, n - 1};
		for (int i = 0; i < 4 && attempts < ATTEMPTS; i++) {
			struct spec less = *spec;
			char text[32];
			snprintf(text, sizeof text, "%d", (int)fewer[i]);
			spec_set(&less, "n", text);
			attempts++;
			if (fewer[i] >= 1 && fails(settings, &less, true, slot, &status)) {
				*spec = less, smaller = true;
				break;
			}
		}
	}
}

static void report(const struct settings *settings, int status, struct slot *slot)
{
	struct spec spec;
	struct slot *again = &shared->slot[JOBS_MAX - 1];
	char line[SPEC_TEXT];
	int repeated;
	printf("FAILED %s\n  %s\n", slot->line, verdict(status, slot));
	if (!spec_parse(slot->line, &spec) || !fails(settings, &spec, true, again, &repeated)) {
		printf("  not repeated by itself\n");
		return;
	}
	shrink(settings, &spec, again);
	fails(settings, &spec, false, again, &repeated);
	spec_write(&spec, line);
	printf("  smaller: %s\n  again with: tests/property/run '%s'\n", verdict(repeated, again), line);
	fflush(stdout);
}

/* ---- The parent ---- */

static pid_t start(const struct settings *settings, struct slot *slot)
{
	fflush(stdout);
	daemon_watch(settings->gnpd, settings->weights, shared->url, sizeof shared->url);
	atomic_store(&slot->busy, 0);
	pid_t child = fork();
	if (child == 0)
		child_draw(settings, slot);
	return child;
}

static size_t draw_all(const struct settings *settings)
{
	pid_t child[JOBS_MAX];
	size_t findings = 0, running = settings->jobs;
	for (unsigned j = 0; j < settings->jobs; j++)
		child[j] = start(settings, &shared->slot[j]);
	while (running) {
		int status;
		pid_t ended = waitpid(-1, &status, 0);
		unsigned j = 0;
		while (j < settings->jobs && child[j] != ended)
			j++;
		if (j == settings->jobs)
			continue; /* the daemon: it is started again when it is needed */
		running--;
		if (status == 0)
			continue;
		findings++;
		report(settings, status, &shared->slot[j]);
		child[j] = start(settings, &shared->slot[j]);
		running++;
	}
	return findings;
}

static bool read_settings(int argc, char **argv, struct settings *settings)
{
	for (int i = 1; i < argc; i++) {
		const char *value = i + 1 < argc ? argv[i + 1] : "";
		if (argv[i][0] != '-' || strcmp(argv[i], "--show") == 0) {
			settings->line = argv[i][0] != '-' ? argv[i] : settings->line;
			settings->show |= argv[i][0] == '-';
			continue;
		}
		if (strcmp(argv[i], "--seed") == 0)
			settings->seed = strtoull(value, NULL, 10);
		else if (strcmp(argv[i], "--draws") == 0)
			settings->draws = strtoull(value, NULL, 10);
		else if (strcmp(argv[i], "--minutes") == 0)
			settings->minutes = strtod(value, NULL);
		else if (strcmp(argv[i], "--weights") == 0)
			settings->weights = value;
		else if (strcmp(argv[i], "--gnpd") == 0)
			settings->gnpd = value;
		else if (strcmp(argv[i], "--lines") == 0)
			settings->lines = value;
		else if (strcmp(argv[i], "--jobs") == 0)
			settings->jobs = (unsigned)strtoul(value, NULL, 10);
		else
			return false;
		i++;
	}
	return settings->jobs >= 1 && settings->jobs < JOBS_MAX;
}

static void load(const char *weights)
{
	struct gnp_error error = {0};
	if (gnp_models_load(weights, &models, &error) != GNP_OK) {
		fprintf(stderr, "property: %s\n", error.text);
		exit(2);
	}
	for (size_t i = 0; i < gnp_models_count(models) && i < MODELS_MAX; i++)
		names[i] = gnp_models_at(models, i)->name;
}

static int run_line(const struct settings *settings)
{
	struct spec spec;
	struct slot *slot = &shared->slot[0];
	int status = 0;
	if (!spec_parse(settings->line, &spec)) {
		fprintf(stderr, "property: \"%s\" is no line of name=value words with op\n", settings->line);
		return 2;
	}
	bool failed = fails(settings, &spec, false, slot, &status);
	printf("%s\n", failed ? verdict(status, slot) : slot->text[0] ? slot->text : "answered");
	return failed;
}

/* Whole before any child is made: one that exits would move the place the parent reads at. Freed by the caller; NULL: it cannot be read. */
static char *read_lines(const char *path)
{
	FILE *file = fopen(path, "r");
	char *text = NULL;
	size_t size = 0;
	if (file && getdelim(&text, &size, '\0', file) < 0) {
		free(text);
		text = NULL;
	}
	if (file)
		fclose(file);
	return text;
}

/* What failed once; returns how many lines there are and adds up those that fail. */
static size_t run_lines(const struct settings *settings, size_t *findings)
{
	struct slot *slot = &shared->slot[0];
	char *text = read_lines(settings->lines), *rest = NULL;
	size_t count = 0;
	for (char *line = text ? strtok_r(text, "\n", &rest) : NULL; line; line = strtok_r(NULL, "\n", &rest), count++) {
		struct spec spec;
		int status;
		bool known = spec_parse(line, &spec);
		if (known && !fails(settings, &spec, false, slot, &status))
			continue;
		printf("FAILED %s\n  %s\n", line, known ? verdict(status, slot) : "is no line of name=value words with op");
		++*findings;
	}
	if (!count) {
		printf("FAILED %s has no lines\n", settings->lines);
		++*findings;
	}
	free(text);
	return count;
}

static int run_draws(const struct settings *settings)
{
	size_t findings = 0, lines = settings->lines ? run_lines(settings, &findings) : 0;
	end = gnp_clock() + 60 * settings->minutes;
	size_t kept = findings;
	findings += draw_all(settings);
	unsigned long long answered = atomic_load(&shared->outcome[TRIAL_ANSWERED]), refused = atomic_load(&shared->outcome[TRIAL_REFUSED]),
	                   slow = atomic_load(&shared->outcome[TRIAL_TOO_LONG]), all = answered + refused + slow + findings - kept;
	printf("property: seed %llu, %llu answered, %llu refused, %llu not waited for\n", (unsigned long long)settings->seed, answered, refused, slow);
	if (5 * answered < all) {
		printf("property: only %llu of %llu requests had an answer\n", answered, all);
		findings++;
	}
	printf("property: %llu passed, %zu failed\n", answered + refused + slow + lines - kept, findings);
	return findings > 0;
}

int main(int argc, char **argv)
{
	struct settings settings = {.seed = 1, .draws = 2000, .weights = "weights", .gnpd = "", .jobs = 2, .seconds = 2};
	gnp_blas_environment_restart(argv);
	if (!read_settings(argc, argv, &settings)) {
		fprintf(stderr, "usage: property [--seed S] [--draws N | --minutes M] [--weights DIR] [--gnpd PROGRAM] [--jobs 1..7] [--lines FILE] [--show] [LINE]\n");
		return 2;
	}
	shared = mmap(NULL, sizeof *shared, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
	if (shared == MAP_FAILED)
		return 2;
	load(settings.weights);
	int code = settings.line ? run_line(&settings) : run_draws(&settings);
	if (!daemon_stop())
		code = 1;
	gnp_models_release(models);
	return code;
}
