#!/bin/sh
# Delta u = -f on a cloud: points and the right-hand sides f (array `source`) as NPZ in, u (array `solution`) as NPZ out. A second call
# with the same points and other right-hand sides finds its operator made.
# Usage: poisson-npz.sh cloud-and-source.npz result.npz [URL]
set -eu
curl --fail-with-body --silent --show-error --data-binary @"$1" -H 'Content-Type: application/x-npz' -H 'Accept: application/x-npz' \
	"${3:-http://127.0.0.1:8080}/v1/poisson?estimator=gmls" -o "$2"
