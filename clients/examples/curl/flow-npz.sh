#!/bin/sh
# Mean-curvature flow: a cloud as PLY in, the end, a record of every step and ten snapshots as NPZ out.
# Usage: flow-npz.sh cloud.ply STEPS result.npz [URL]
set -eu
every=$((($2 + 9) / 10))
curl --fail-with-body --silent --show-error --data-binary @"$1" -H 'Content-Type: application/ply' -H 'Accept: application/x-npz' \
	"${4:-http://127.0.0.1:8080}/v1/flow?estimator=gmls&steps=$2&snapshot_every=$every" -o "$3"
