#!/bin/sh
# Install Chromium, in which `make browser-tests` drives the report pages, where it is missing and
# can be installed; without it these tests are skipped.
set -eu
cd "$(dirname "$0")/.."
name="set-up of the browser"
. scripts/system.sh

for program in ${OPTISENSE_BROWSER:-} chromium chromium-browser google-chrome google-chrome-stable; do
    if command -v "$program" >/dev/null 2>&1; then
        say "The browser tests will use $program."
        exit 0
    fi
done
[ "$can_install" = yes ] || fail "no right to install chromium here.
Name a browser that is there: OPTISENSE_BROWSER=/path/to/chromium make browser-tests"
apt_install chromium || fail "this system offers no package named chromium."
