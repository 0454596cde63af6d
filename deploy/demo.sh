#!/bin/sh
# make demo: builds gnpd, sends it a noisy cloud without normals as PLY, once for each estimator, shows what came back. See README.md here.
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

# The value of a key in the JSON of `gnp compare`.
value() { sed "s/.*\"$2\": \([^,}]*\).*/\1/" "$1"; }

# draw FILE.ply PICTURE.png: the analytic cloud's pictures share the colour bar of its exact curvatures.
limits=
draw() {
	# shellcheck disable=SC2086
	"$OUT/gnp" plot "$1" --field mean_curvature --size 920x690 $limits -o "$2"
}

if [ -n "$CLOUD" ]; then
	"$OUT/gnp" convert "$CLOUD" --fields points -o "$folder/input.ply"
else
	echo 'sampling 100,000 points of a toroidal surface; noise of 0.001 on all, of 0.005 on one point of twenty'
	"$OUT/gnp" sample toroidal --points 100000 --seed 1 --noise 1e-3 --outliers 0.05,5e-3 -o "$folder/exact.ply"
	"$OUT/gnp" convert "$folder/exact.ply" --fields points -o "$folder/input.ply"
	limits='--limits -9,9'
	draw "$folder/exact.ply" "$folder/exact.png"
fi
echo "sending $folder/input.ply ($(wc -c <"$folder/input.ply") bytes, no normals) to $url, once for each estimator"
echo

[ -n "$CLOUD" ] || printf '%-10s %15s %15s %15s %9s  %s\n' estimator 'normals, degree' 'H, rel. L2' 'K, rel. L2' seconds weights
for estimator in gnp gmls adaptive; do
	result=$folder/$estimator.ply
	estimate "$folder/input.ply" "$result" "estimator=$estimator&quantities=normals,mean_curvature,gaussian_curvature"
	weights=$(comment "$result" weights)
	if [ -n "$CLOUD" ]; then
		echo "$estimator${weights:+ by $weights}, $seconds s"
		"$OUT/gnp" info "$result" --fields mean_curvature,gaussian_curvature
	else
		"$OUT/gnp" compare "$result" "$folder/exact.ply" --json >"$folder/errors.json"
		printf '%-10s %15.2f %15.3f %15.3f %9.2f  %s\n' "$estimator" "$(value "$folder/errors.json" normals_angle_mean)" \
			"$(value "$folder/errors.json" mean_curvature)" "$(value "$folder/errors.json" gaussian_curvature)" "$seconds" "${weights:--}"
		rm -f "$folder/errors.json"
	fi
	[ "$estimator" != gnp ] || print_seconds "$result" >"$folder/seconds"
	draw "$result" "$folder/$estimator.png"
done

echo
echo "where the seconds of gnp went:"
cat "$folder/seconds"
rm -f "$folder/seconds"
echo
echo "the cloud:    $folder/input.ply"
echo "the results:  $folder/{gnp,gmls,adaptive}.ply"
echo "the pictures: $folder/{gnp,gmls,adaptive}.png$([ -n "$CLOUD" ] || echo ", beside $folder/exact.png") (mean curvature; outward normals, so H = -1/R on a sphere)"
