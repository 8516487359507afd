#!/bin/bash
# usage: web/tests/run.sh PATH_OF_SHIFTRIG
# The pages in a real browser, and that the committed dist/ is what the sources build.
set -eu
export SHIFTRIG
SHIFTRIG=$(realpath "$1")
cd "$(dirname "$0")/.."
npm ci --no-audit --no-fund --loglevel=error
fresh=$(mktemp -d)
trap 'rm -rf "$fresh"' EXIT
for page in report dashboard; do
    npx vite build --mode "$page" --outDir "$fresh" --logLevel error
    cmp "dist/$page.html" "$fresh/$page.html" || { echo "dist/$page.html is not what web/src builds: npm run build" >&2; exit 1; }
done
node --test tests/
