#!/usr/bin/env bash
# Fetches the chart script of the report, as published on npm, into src/report/html/vendor/, as base64 of gzip.
# Usage: scripts/vendor.sh [VERSION]; without VERSION, the one that src/report/html/vendor/README.md names.
set -euo pipefail
cd "$(dirname "$0")/../src/report/html/vendor"

package=plotly.js-cartesian-dist-min
version=${1:-$(sed -n "s/^| \`$package\` | \([^ ]*\) |.*/\1/p" README.md)}
[ -n "$version" ] || { echo "scripts/vendor.sh: README.md names no version of $package" >&2; exit 1; }
command -v npm >/dev/null || { echo 'scripts/vendor.sh: npm not found' >&2; exit 1; }

folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
npm pack --silent --pack-destination "$folder" "$package@$version" >/dev/null
tar -xzf "$folder/$package-$version.tgz" -C "$folder"
install -m 644 "$folder/package/LICENSE" .
gzip -9 -n -c "$folder/package/plotly-cartesian.min.js" | base64 -w 0 > plotly-cartesian.min.js.gz.base64
echo "$package $version: $(wc -c < plotly-cartesian.min.js.gz.base64) bytes"
