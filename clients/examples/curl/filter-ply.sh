#!/bin/sh
# A cloud as PLY in, the cloud without outliers as PLY out, its points moved onto the surface; comments say how many were dropped.
# Usage: filter-ply.sh cloud.ply result.ply [URL]
set -eu
curl --fail-with-body --silent --show-error --data-binary @"$1" -H 'Content-Type: application/ply' \
	"${3:-http://127.0.0.1:8080}/v1/filter?project=true&gross=3" -o "$2"
