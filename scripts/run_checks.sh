#!/bin/sh
# Run the named targets of the Makefile one after another, each whatever became of those before,
# and say at the end which passed. Those named after `--beside` run at the same time; what they
# print follows at the end. The exit status is 1 if one failed.
set -u
cd "$(dirname "$0")/.."
make=${MAKE:-make}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
# What runs beside the others does not hear Ctrl-C: the shell hides it from background jobs.
trap 'printf "\nInterrupted.\n" >&2; cat "$folder"/*.told >&2; trap "" TERM; kill 0; exit 130' INT

run() { # a name for the file of what came of them, and targets
    told=$folder/$1.told
    shift
    : >"$told"
    for check in "$@"; do
        if [ "$check" = studio-tests ] && why=$(sh scripts/setup_blender.sh --why-not) \
            && [ -n "$why" ]
        then
            printf '%-13s NOT RUN: %s\n' "$check" "$why" >>"$told"
            continue
        fi
        printf '\n== %s\n' "$check"
        began=$(date +%s)
        result=FAILED
        $make --no-print-directory "$check" && result=passed
        printf '%-13s %s, %s s\n' "$check" "$result" "$(($(date +%s) - began))" >>"$told"
    done
}

first=
while [ $# -gt 0 ] && [ "$1" != --beside ]; do
    first="$first $1"
    shift
done
if [ $# -gt 0 ]; then
    shift
    run second "$@" >"$folder/second.log" 2>&1 &
fi
run first $first
wait
[ ! -f "$folder/second.log" ] || cat "$folder/second.log"

printf '\n== Summary\n'
cat "$folder"/*.told
failed=$(cat "$folder"/*.told | grep -c ' FAILED, ') || true
[ "$failed" -eq 0 ] || { echo "$failed checks failed." >&2; exit 1; }
