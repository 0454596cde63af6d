#!/bin/sh
# Is the server alive, is it ready for work, and what does it offer?
# Usage: health.sh [URL]
set -eu
url=${1:-http://127.0.0.1:8080}
for path in /v2/health/live /v2/health/ready /v2 /v2/models/estimate; do
	printf '%s ' "$path"
	curl --silent --show-error --write-out ' (HTTP %{http_code})\n' "$url$path"
done
