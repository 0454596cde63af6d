#!/bin/sh
# make demo: builds gnpd, sends it a cloud without normals as PLY, shows what came back. See README.md here.
# BUILD: the build folder (build). OUT: where the programs come to lie in it (a sanitizer's are deeper).
# CLOUD: a PLY file of your own instead of the analytic one.
set -eu
cd "$(dirname "$0")/.."
BUILD=${BUILD:-build} CLOUD=${CLOUD-}
OUT=${OUT:-$BUILD}
[ -z "$CLOUD" ] || [ -r "$CLOUD" ] || { echo "demo: $CLOUD: cannot read" >&2; exit 1; }
deploy/install-deps.sh demo
"${MAKE:-make}" --no-print-directory BUILD="$BUILD" all >/dev/null
folder=$OUT/demo
mkdir -p "$folder"
rm -f "$folder"/*.ply "$folder"/*.png
. deploy/daemon.sh
daemon_start "$OUT" "$folder"

if [ -n "$CLOUD" ]; then
	"$OUT/gnp" convert "$CLOUD" --fields points -o "$folder/input.ply"
else
	echo 'sampling 100,000 points of a toroidal surface'
	"$OUT/gnp" sample toroidal --points 100000 --seed 1 -o "$folder/exact.ply"
	"$OUT/gnp" convert "$folder/exact.ply" --fields points -o "$folder/input.ply"
fi
echo "sending $folder/input.ply ($(wc -c <"$folder/input.ply") bytes, no normals) to $url"
estimate "$folder/input.ply" "$folder/result.ply" 'quantities=normals,mean_curvature,gaussian_curvature'

echo
if [ -n "$CLOUD" ]; then
	"$OUT/gnp" info "$folder/result.ply" --fields mean_curvature,gaussian_curvature
else
	"$OUT/gnp" compare "$folder/result.ply" "$folder/exact.ply"
fi
echo
print_seconds "$folder/result.ply"
"$OUT/gnp" plot "$folder/result.ply" --field mean_curvature -o "$folder/result.png"
echo
echo "the cloud:   $folder/input.ply"
echo "the result:  $folder/result.ply"
echo "the picture: $folder/result.png (mean curvature; outward normals, so H = -1/R on a sphere)"
