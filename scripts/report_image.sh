#!/usr/bin/env bash
# Renew docs/images/report.png: the report of `bondline study cases/lcat-2259` in headless Chromium, from the chart of
# the nominal temperatures to the table of peaks.
set -euo pipefail
cd "$(dirname "$0")/.."

fail() { printf 'scripts/report_image.sh: %s\n' "$*" >&2; exit 1; }

browser=$(command -v chromium chromium-browser google-chrome google-chrome-stable | head -n 1) ||
    fail 'no browser found: apt-get install chromium'
cargo build --profile work --quiet --bin bondline
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${CARGO_TARGET_DIR:-target}/work/bondline" study cases/lcat-2259 --quiet --out "$folder/report" >"$folder/screen.txt"
# The screenshot begins at the top of the page, so a script moves the section there; charts are drawn when they are in
# view.
cat >>"$folder/report/report.html" <<'SCRIPT'
<script>
  document.querySelector("nav").style.position = "static";
  let shift = 0;
  setInterval(() => {
    shift += 560 - document.getElementById("uncertainty").getBoundingClientRect().top;
    document.body.style.marginTop = `${shift}px`;
  }, 500);
</script>
SCRIPT
"$browser" --headless --no-sandbox --hide-scrollbars --user-data-dir="$folder/profile" --window-size=1100,872 \
    --virtual-time-budget=60000 --screenshot="$folder/report.png" "file://$folder/report/report.html" \
    2>"$folder/log.txt" || fail "$(cat "$folder/log.txt")"
[ -s "$folder/report.png" ] || fail "no picture: $(cat "$folder/log.txt")"
mv "$folder/report.png" docs/images/report.png
echo 'docs/images/report.png'
