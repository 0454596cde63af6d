#!/bin/sh
# The Open Inference Protocol, all JSON: 400 points of a paraboloid, H and K back.
# Usage: infer-json.sh [URL]
set -eu
points=$(awk 'BEGIN { for (i = 0; i < 400; i++) { x = (i % 20) / 20; y = int(i / 20) / 20; printf "%s%g,%g,%g", i ? "," : "", x, y, x * x / 2 + y * y / 2 } }')
curl --fail-with-body --silent --show-error "${1:-http://127.0.0.1:8080}/v2/models/estimate/infer" --data-binary @- <<END
{"parameters": {"estimator": "gnp", "weights": "auto", "cover": "all"},
 "inputs": [{"name": "points", "shape": [400, 3], "datatype": "FP64", "data": [$points]}],
 "outputs": [{"name": "mean_curvature"}, {"name": "gaussian_curvature"}]}
END
echo
