/* Reads the configuration: a struct with defaults that a file, the environment and flags edit, in this order of rising
 * precedence.
 *
 * One table (config_keys.c) drives the flags (--queue-count 64), the environment (GNPD_QUEUE_COUNT=64), the keys of
 * the file (queue-count = 64), --help, --print-config and the range checks. An unknown key is an error. */
#ifndef GNPD_CONFIG_H
#define GNPD_CONFIG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "core/base/status.h"

#define GNPD_CONFIG_TEXT 1024

struct gnpd_log;

struct gnpd_config {
	char listen[GNPD_CONFIG_TEXT];      /* ADDRESS:PORT, [ADDRESS]:PORT or localhost:PORT; port 0: any free one */
	char port_file[GNPD_CONFIG_TEXT];   /* the port in use is written here once requests are answered; "" for none */
	char weights_dir[GNPD_CONFIG_TEXT]; /* "": the default folders of gnp_models_load */
	bool insecure;                      /* allow an address other than loopback without keys */
	char keys_file[GNPD_CONFIG_TEXT];   /* "": nobody is asked for a key */
	char tls_certificate[GNPD_CONFIG_TEXT], tls_key[GNPD_CONFIG_TEXT]; /* PEM files, both or neither */
	char admin_listen[GNPD_CONFIG_TEXT]; /* as listen; "": no admin listener */
	char admin_port_file[GNPD_CONFIG_TEXT];
	char allowed_hosts[GNPD_CONFIG_TEXT]; /* names clients call the server by, beside localhost and addresses (site.h); "": none */
	size_t admin_connections;           /* of the admin listener */
	size_t workers;                     /* compute threads; 0: the number of cores */
	size_t runners;                     /* requests computed at once */
	size_t http_threads;
	size_t max_connections;
	size_t max_connections_per_address; /* 0: any number */
	size_t max_body_bytes;              /* of one request, as it is sent */
	size_t max_decoded_bytes;           /* the same after decompression; 0: as max_body_bytes */
	size_t request_memory_bytes;        /* body and estimated memory of one request */
	size_t max_points;                  /* of one request */
	size_t queue_count;                 /* requests that may wait for a runner */
	size_t queue_bytes;                 /* bodies plus estimated memory of all requests held */
	size_t prepared_cache_bytes;        /* prepared operators kept for later right-hand sides */
	size_t discard_bytes;               /* of a refused body, read so that the client gets to see the answer */
	size_t linger_bytes;                /* of a longer one, read after the answer */
	double linger_seconds;              /* and for how long */
	size_t connection_memory_bytes;     /* headers and read buffer of one connection */
	size_t min_body_rate;               /* bytes a second a client must keep up after body_grace_seconds */
	double body_grace_seconds;
	double header_seconds;              /* for the request line and headers */
	double body_seconds;                /* for the whole body */
	double reply_seconds;               /* for the client to take the answer */
	double idle_seconds;                /* between requests of a connection */
	double work_seconds;                /* from the end of the body to the answer, waiting included */
	double drain_notice_seconds;        /* for load balancers to hear that it is not ready, before it drains */
	double drain_seconds;               /* for running work after SIGTERM */
	double retry_after_seconds;         /* what a 503 tells the client */
	char jobs_dir[GNPD_CONFIG_TEXT];    /* "": jobs do not survive the process */
	size_t job_runners;                 /* jobs that run at once */
	size_t jobs_count;                  /* jobs kept, those that are over among them */
	size_t jobs_bytes;                  /* of their bodies, checkpoints and results */
	size_t jobs_memory_bytes;           /* of queue_bytes that jobs may hold; 0: three quarters */
	size_t jobs_queue_count;            /* jobs that may wait for a runner */
	size_t jobs_watch_count;            /* requests that may wait for a job to change */
	size_t jobs_attempts;               /* deaths of the process while it runs, after which a job has failed */
	double jobs_seconds;                /* a run of a job */
	double jobs_ttl_seconds;            /* before a job that is over expires, and again before it is forgotten */
	double jobs_wait_seconds;           /* of a long poll */
	double jobs_heartbeat_seconds;      /* between signs of life in a stream of events */
	double jobs_checkpoint_seconds;     /* between two checkpoints of a job */
	int log_format;                     /* enum gnpd_log_format */
	int log_level;                      /* enum gnpd_log_level at the start */
	bool access_log;
	const char *old_key;                /* the old name by which a key was given; NULL: none was */
};

/* What the flags ask for, a set. */
enum gnpd_config_action {
	GNPD_CONFIG_RUN = 0, GNPD_CONFIG_HELP = 1, GNPD_CONFIG_VERSION = 2, GNPD_CONFIG_CHECK = 4, GNPD_CONFIG_PRINT = 8
};

void gnpd_config_defaults(struct gnpd_config *config);

/* Sets one field from text. GNP_INVALID_ARGUMENT names the key, the value and the range. */
gnp_status gnpd_config_set(struct gnpd_config *config, const char *key, const char *text, struct gnp_error *error);

/* Reads `key = value` lines; # begins a comment line. Errors name file and line, of a key given twice, by whatever
 * name, both lines. */
gnp_status gnpd_config_read_file(struct gnpd_config *config, const char *path, struct gnp_error *error);
/* The same of an open stream, which stays the caller's; path stands for it in messages. */
gnp_status gnpd_config_read_stream(struct gnpd_config *config, FILE *file, const char *path, struct gnp_error *error);

/* Defaults, then the file (--config or GNPD_CONFIG), the environment, the flags; then the checks that involve the
 * machine (the addresses are loopback, or there are keys, or insecure is set; weights_dir is a readable directory,
 * those of the port files can be written to; jobs_dir is the store's to check). *actions: a set of enum
 * gnpd_config_action. */
gnp_status gnpd_config_load(struct gnpd_config *config, int argc, char *const *argv, char *const *environment,
                            unsigned *actions, struct gnp_error *error);

/* May the server listen at an address that is not loopback? key: the one that named it; address: as text. */
gnp_status gnpd_config_allows(const struct gnpd_config *config, const char *key, const char *address, struct gnp_error *error);

/* Every numeric key with its value, by its old name too. */
typedef void (*gnpd_config_visit)(void *context, const char *key, double value);
void gnpd_config_numbers(const struct gnpd_config *config, gnpd_config_visit visit, void *context);

/* Warns of a key that was given by its old name, which the next version does not know any more. */
void gnpd_config_warn(const struct gnpd_config *config, struct gnpd_log *log);

/* In the form gnpd_config_read_file reads. */
void gnpd_config_print(const struct gnpd_config *config, FILE *file);
void gnpd_config_help(FILE *file);

#endif
