#!/bin/sh
# A cloud as PLY in, the cloud with normals and curvatures as PLY out.
# Usage: estimate-ply.sh cloud.ply result.ply [URL]
set -eu
curl --fail-with-body --silent --show-error --data-binary @"$1" -H 'Content-Type: application/ply' \
	"${3:-http://127.0.0.1:8080}/v1/estimate?quantities=normals,mean_curvature,gaussian_curvature" -o "$2"
