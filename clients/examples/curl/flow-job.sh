#!/bin/sh
# Mean-curvature flow as a job: submits it, waits for its end, fetches the cloud. Running it again with the same KEY asks for the same job.
# Usage: flow-job.sh cloud.ply STEPS KEY result.ply [URL]
set -eu
url=${5:-http://127.0.0.1:8080}
job=$url$(curl --fail-with-body --silent --show-error --data-binary @"$1" -H 'Content-Type: application/ply' -H "Idempotency-Key: $3" \
	-o /dev/null -D - "$url/v1/jobs/flow?estimator=gmls&steps=$2" | sed -n 's/^[Ll]ocation: \([^[:cntrl:]]*\).*/\1/p')
while curl --fail-with-body --silent --show-error "$job?wait=30s" | grep -q '"state":"\(queued\|running\)"'; do :; done
curl --fail-with-body --silent --show-error "$job/result" -o "$4"
