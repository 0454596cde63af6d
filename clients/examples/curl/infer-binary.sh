#!/bin/sh
# The Open Inference Protocol with binary tensors: raw little-endian float32 x y z triples in; the answer is a JSON head
# (its length is in the Inference-Header-Content-Length header) followed by the tensors' bytes.
# Usage: infer-binary.sh points.f32 answer.bin [URL]
set -eu
size=$(wc -c <"$1")
head="{\"inputs\": [{\"name\": \"points\", \"shape\": [$((size / 12)), 3], \"datatype\": \"FP32\", \"parameters\": {\"binary_data_size\": $((size))}}],
 \"outputs\": [{\"name\": \"normals\", \"parameters\": {\"binary_data\": true}}, {\"name\": \"mean_curvature\", \"parameters\": {\"binary_data\": true}}]}"
{ printf '%s' "$head"; cat "$1"; } | curl --fail-with-body --silent --show-error --data-binary @- \
	-H 'Content-Type: application/octet-stream' -H "Inference-Header-Content-Length: $(printf '%s' "$head" | wc -c)" \
	--dump-header - "${3:-http://127.0.0.1:8080}/v2/models/estimate/infer" -o "$2"
