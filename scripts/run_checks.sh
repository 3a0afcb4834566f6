#!/bin/sh
# Run the named targets of the Makefile one after another, each whatever became of those before,
# and say at the end which passed. The exit status is 1 if one failed.
set -u
cd "$(dirname "$0")/.."
make=${MAKE:-make}
summary=
failed=0
line='
'
trap 'printf "\nInterrupted.%s\n" "$summary" >&2; exit 130' INT

for check in "$@"; do
    if [ "$check" = studio-tests ] && why=$(sh scripts/setup_blender.sh --why-not) && [ -n "$why" ]
    then
        summary="$summary$line$(printf '%-13s NOT RUN: %s' "$check" "$why")"
        continue
    fi
    printf '\n== %s\n' "$check"
    began=$(date +%s)
    if $make --no-print-directory "$check"; then
        result=passed
    else
        result=FAILED
        failed=$((failed + 1))
    fi
    summary="$summary$line$(printf '%-13s %s, %s s' "$check" "$result" "$(($(date +%s) - began))")"
done

printf '\n== Summary%s\n' "$summary"
[ "$failed" -eq 0 ] || { echo "$failed of $# checks failed." >&2; exit 1; }
