#!/bin/sh
# Run the named targets of the Makefile, several at a time in the given order, each whatever became
# of the others, and say at the end which passed. What a target prints follows when it has ended, so
# that the lines of two targets do not mix. The exit status is 1 if one failed.
set -u
cd "$(dirname "$0")/.."
make=${MAKE:-make}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
# Background jobs do not hear Ctrl-C: the shell hides it from them.
trap 'printf "\nInterrupted.\n" >&2; cat "$folder"/*.outcome >&2; trap "" TERM; kill 0; exit 130' INT

# Most of the time one thread of a target works, and a seventh of the time it waits for a browser or
# for a clock, so that only four targets at a time keep two processors busy. A target takes up to
# 3 GiB of memory; where four do not fit, two run. Each has its share of the processors: the threads
# of renderers that share processors would take a tenth to a fifth of the time to wait for work.
at_a_time=2
free=$(awk '/^MemAvailable:/ { print int($2 / 2^20) }' /proc/meminfo 2>/dev/null)
[ "${free:-0}" -lt 12 ] || at_a_time=4
processors=$(nproc 2>/dev/null || echo 0)
share=$((processors < at_a_time ? 1 : processors / at_a_time))

run_target() { # a target, on the processors of a turn where that can be said
    first=$(($2 * share % (processors > 0 ? processors : 1)))
    if taskset -c "$first-$((first + share - 1))" true 2>/dev/null; then
        taskset -c "$first-$((first + share - 1))" $make --no-print-directory "$1"
    else
        $make --no-print-directory "$1"
    fi
}

check() { # one target: what it prints, its outcome, and its turn for the next one
    name=$1
    turn=$2
    : >"$folder/$name.log"
    if [ "$name" = studio-tests ] && why=$(sh scripts/setup_blender.sh --why-not) && [ -n "$why" ]
    then
        printf '%-16s NOT RUN: %s\n' "$name" "$why" >"$folder/$name.outcome"
    else
        began=$(date +%s)
        result=FAILED
        run_target "$name" "$turn" >"$folder/$name.log" 2>&1 && result=passed
        printf '%-16s %s, %s s\n' "$name" "$result" "$(($(date +%s) - began))" \
            >"$folder/$name.outcome"
    fi
    # One write for the whole text, which that of another target does not divide.
    printf '\n== %s\n%s\n%s\n' "$name" "$(cat "$folder/$name.log")" "$(cat "$folder/$name.outcome")"
    echo "$turn" >&3
}

# Programs that tests start are forks of one Python that has imported everything: see
# tests/helpers/warm_python.py. It ends when this shell, which alone writes to its input, has ended.
if [ "$(uname)" = Linux ]; then
    mkdir "$folder/programs"
    mkfifo "$folder/input" "$folder/output"
    OPTISENSE_LIBRARY="$folder/none" XDG_STATE_HOME="$folder/none" .venv/bin/python \
        tests/helpers/warm_python.py "$folder/programs" --render \
        <"$folder/input" >"$folder/output" 2>/dev/null &
    exec 4>"$folder/input"
    read -r _ <"$folder/output" && export WARM_PYTHON="$folder/programs"
fi

mkfifo "$folder/turns"
exec 3<>"$folder/turns"
checks=
turn=0
while [ "$turn" -lt "$at_a_time" ]; do
    echo "$turn" >&3
    turn=$((turn + 1))
done
for name in "$@"; do
    read -r turn <&3
    printf '%s begins\n' "$name"
    check "$name" "$turn" 4>&- &
    checks="$checks $!"
done
wait $checks
exec 4>&-
wait

printf '\n== Summary\n'
for name in "$@"; do cat "$folder/$name.outcome"; done
failed=$(cat "$folder"/*.outcome | grep -c ' FAILED, ') || true
[ "$failed" -eq 0 ] || { echo "$failed checks failed." >&2; exit 1; }
