#!/bin/sh
# usage: run.sh MAKE_RECORDING SHIFTRIG DIRECTORY SOURCE_FOLDER
# Exports two recordings as MCAP and CSV, one made up and the demo's, and lets MCAP's own library compare the two forms.
set -e
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$3" && cd "$3"
"$1" made_up.lcmlog 2000
# As scripts/demo runs it.
"$2" run "$4/config/tractor.yaml" --scenario "$4/config/scenarios/plough_upshift.yaml" --pace wall --bus inprocess \
    --controller "builtin:$4/config/calibration/tractor.yaml" --record demo.lcmlog > demo.log 2>&1 || { cat demo.log; exit 1; }
cp -p "$here/package.json" "$here/package-lock.json" "$here/.npmrc" "$here/check.mjs" .
[ -e node_modules/.package-lock.json ] && [ node_modules/.package-lock.json -nt package-lock.json ] || npm ci --no-audit --no-fund
for name in made_up demo; do
    "$2" export $name.lcmlog --csv $name.csv --mcap $name.mcap
    node check.mjs $name.mcap $name.csv
done
