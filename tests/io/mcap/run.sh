#!/bin/sh
# usage: run.sh MAKE_RECORDING SHIFTRIG DIRECTORY
# Exports a recording as MCAP and CSV and lets MCAP's own library compare the two.
set -e
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$3" && cd "$3"
"$1" made_up.lcmlog 2000
"$2" export made_up.lcmlog --csv made_up.csv --mcap made_up.mcap
cp -p "$here/package.json" "$here/package-lock.json" "$here/.npmrc" "$here/check.mjs" .
[ -e node_modules/.package-lock.json ] && [ node_modules/.package-lock.json -nt package-lock.json ] || npm ci --no-audit --no-fund
node check.mjs made_up.mcap made_up.csv
