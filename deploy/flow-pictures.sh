#!/bin/sh
# make flow-pictures: runs the paper's four flows and draws them into core/flow. See core/flow/FLOW.md.
# BUILD: the build folder (build). OUT: where the programs are in it. POINTS: of the analytic shapes (20000).
set -eu
cd "$(dirname "$0")/.."
BUILD=${BUILD:-build}
OUT=${OUT:-$BUILD}
POINTS=${POINTS:-20000}
folder=$OUT/flow-pictures
animal=$BUILD/meshes/bear.ply
mkdir -p "$folder"

# draw NAME CLOUD PARAMETERS: three states of the flow of a cloud
draw() {
	"$OUT/gnp" flow "$2" --local $3 -o "$folder/$1.npz"
	"$OUT/gnp" snapshots "$folder/$1.npz" -o "$folder/$1-%06d.ply" >/dev/null
	at=0
	for state in $(ls "$folder/$1"-[0-9]*.ply | sed -n '1p;2p;$p'); do
		"$OUT/gnp" plot "$state" --field mean_curvature $4 --size 400x300 -o "core/flow/flow-$1-$at.png"
		at=$((at + 1))
	done
}

# The paper takes 500 steps of 1e-4 with 100,000 points: the same time in steps that follow the spacing squared.
steps=$((500 * POINTS / 100000))
dt=$(awk "BEGIN { print 1e-4 * 100000 / $POINTS }")
for shape in bumpy_torus genus3 genus2; do
	rm -f "$folder/$shape"-[0-9]*.ply
	"$OUT/gnp" sample "$shape" --points "$POINTS" -o "$folder/$shape.ply"
	draw "$shape" "$folder/$shape.ply" \
		"--scheme explicit --weights fit_clean_50k --dt $dt --steps $steps --snapshot_every $((steps / 4))" ''
done
if [ -f "$animal" ]; then
	rm -f "$folder/bear"-[0-9]*.ply
	draw bear "$animal" '--weights fit_clean_50k --steps 80 --snapshot_every 20' '--up y --view 20,12'
else
	echo "flow-pictures: no animal: $animal is missing; make meshes fetches it" >&2
fi
