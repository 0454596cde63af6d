#!/bin/sh
# Installs what gnpd needs from the system's packages, or checks that it is there.
#
#   install-deps.sh [STAGE...]          install what is missing (apt-get, through sudo when not root)
#   install-deps.sh --check [STAGE...]  install nothing; say which packages bring what is missing, exit 1 if any
#   install-deps.sh --list [STAGE...]   print the packages
#
# Stages: build (compiler and libraries), demo (build + curl), test (demo + oracles), fuzz (test + clang), lint (build + cppcheck and
# clang-tidy), peers (what make validate-real fetches meshes with, and programs of others that it judges). The default is demo.
set -eu

build='gcc make pkg-config libc6-dev libmicrohttpd-dev libgnutls28-dev libjansson-dev nettle-dev libopenblas-dev libflann-dev libsuitesparse-dev libpng-dev zlib1g-dev libzip-dev libcurl4-openssl-dev'
demo="$build curl ca-certificates"
test="$demo python3 python3-numpy openssl libarpack2"
fuzz="$test clang libclang-rt-14-dev"
peers="$build g++ python3-numpy python3-open3d libpcl-dev libcgal-dev libeigen3-dev npm nodejs"
lint="$build cppcheck clang-tidy"

mode=install
case "${1-}" in
--check) mode=check; shift ;;
--list) mode=list; shift ;;
-h | --help) sed -n '2,9s/^# \{0,1\}//p' "$0"; exit 0 ;;
esac
[ $# -gt 0 ] || set -- demo

packages=
for stage; do
	case "$stage" in
	build) packages="$packages $build" ;;
	demo) packages="$packages $demo" ;;
	test) packages="$packages $test" ;;
	fuzz) packages="$packages $fuzz" ;;
	lint) packages="$packages $lint" ;;
	peers) packages="$packages $peers" ;;
	*) echo "install-deps.sh: stage: got '$stage', need build, demo, test, fuzz, lint or peers" >&2; exit 2 ;;
	esac
done

# Is what the package brings usable? Libraries and tools may come from elsewhere than dpkg, so those are asked first.
present() {
	case "$1" in
	gcc) command -v cc || command -v gcc ;;
	make | pkg-config | curl | python3 | openssl | clang | cppcheck | clang-tidy | npm | g++) command -v "$1" ;;
	nodejs) command -v node ;;
	libmicrohttpd-dev) pkg-config --exists libmicrohttpd ;;
	libgnutls28-dev) pkg-config --exists gnutls ;;
	libjansson-dev) pkg-config --exists jansson ;;
	nettle-dev) pkg-config --exists nettle ;;
	libpng-dev) pkg-config --exists libpng ;;
	zlib1g-dev) pkg-config --exists zlib ;;
	libzip-dev) pkg-config --exists libzip ;;
	libcurl4-openssl-dev) pkg-config --exists libcurl ;;
	libclang-rt-14-dev) test -f "$(clang --print-runtime-dir)/libclang_rt.fuzzer-$(uname -m).a" ;;
	python3-numpy) /usr/bin/python3 -c 'import numpy' ;;
	*) false ;;
	esac >/dev/null 2>&1 && return 0
	dpkg-query -W -f '${db:Status-Status}' "$1" 2>/dev/null | grep -qx installed
}

missing=
for package in $packages; do
	case " $missing " in *" $package "*) continue ;; esac
	[ "$mode" != list ] && present "$package" && continue
	missing="$missing $package"
done
missing=${missing# }

if [ "$mode" = list ]; then
	echo "$missing" | tr ' ' '\n'
	exit 0
fi
[ -n "$missing" ] || exit 0
if [ "$mode" = check ]; then
	echo "missing Debian packages: $missing" >&2
	echo "'make deps' installs them (or: apt-get install $missing)" >&2
	exit 1
fi
if ! command -v apt-get >/dev/null 2>&1; then
	echo "This machine has no apt-get. Install what these Debian 12 packages bring, then run this again: $missing" >&2
	exit 1
fi
sudo=
if [ "$(id -u)" -ne 0 ]; then
	command -v sudo >/dev/null 2>&1 || { echo "not root and no sudo; run as root: apt-get install $missing" >&2; exit 1; }
	sudo=sudo
fi
echo "installing: $missing"
$sudo env DEBIAN_FRONTEND=noninteractive apt-get update -qq
# shellcheck disable=SC2086
$sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing >/dev/null
