#!/usr/bin/env bash
# The steps of the action; each also works by hand: bash run.sh install . && bash run.sh test tests/
#
#   install SOURCE     install tvist[testing]: from a checkout, a folder with wheels, or a requirement
#   serve [OPTION...]  serve a robot in the background, and wait until it is ready to be moved
#   test [ARGUMENT...] run pytest; recordings of failed tests go to ./tvist-recordings
#   programs ARG...    run programs in URScript in lockstep; the results go to ./tvist-programs.xml
#   stop               end the served robot
set -euo pipefail

python=${PYTHON:-python}
folder=${RUNNER_TEMP:-${TMPDIR:-/tmp}}
log=$folder/tvist-serve.log
pid=$folder/tvist-serve.pid
# Attempts to reach the robot; each takes a second or more, and the first start compiles for up to a minute.
attempts=${TVIST_ATTEMPTS:-180}

output() { echo "$1" >>"${GITHUB_OUTPUT:-/dev/stdout}"; }

fail() {
  echo "tvist action: $1" >&2
  exit 1
}

install() {
  [ $# -eq 1 ] || fail "install takes one argument: a checkout, a folder with wheels, or a requirement"
  local source=$1 parts=() part
  if [ -f "$source/pyproject.toml" ]; then
    for part in "$source"/*/pyproject.toml; do
      if [ -f "$part" ]; then parts+=("$(dirname "$part")"); fi
    done
    "$python" -m pip install --quiet "${parts[@]}" "${source%/}[testing]"
  elif compgen -G "$source/*.whl" >/dev/null; then
    "$python" -m pip install --quiet --find-links "$source" "tvist[testing]"
  elif [ -e "$source" ]; then
    fail "$source is neither a checkout of tvist nor a folder with wheels"
  else
    "$python" -m pip install --quiet "$source"
  fi
}

serve() {
  local endpoint=tcp/127.0.0.1:7447 number
  if [ -f "$pid" ] && kill -0 "$(cat "$pid")" 2>/dev/null; then fail "a robot is already served: run stop first"; fi
  "$python" -m tvist_cli serve --listen "$endpoint" "$@" >"$log" 2>&1 &
  echo $! >"$pid"
  for ((number = 0; number < attempts; number++)); do
    if ! kill -0 "$(cat "$pid")" 2>/dev/null; then
      rm -f "$pid"
      fail "the robot ended at its start: $(tail -n 3 "$log")"
    fi
    if "$python" -m tvist_cli check "$endpoint" >"$folder/tvist-check.log" 2>&1; then
      output "endpoint=$endpoint"
      return
    fi
    sleep 1
  done
  fail "the robot is not ready: $(cat "$folder/tvist-check.log")"
}

run_tests() {
  output "recordings=$PWD/tvist-recordings"
  "$python" -m pytest --tvist-recordings "$PWD/tvist-recordings" "$@"
}

run_programs() {
  output "junit=$PWD/tvist-programs.xml"
  "$python" -m tvist_cli run --lockstep --junit "$PWD/tvist-programs.xml" "$@"
}

stop() {
  [ -f "$pid" ] || fail "no robot is served"
  local number
  kill "$(cat "$pid")" 2>/dev/null || true
  for ((number = 0; number < 100; number++)); do
    kill -0 "$(cat "$pid")" 2>/dev/null || break
    sleep 0.1
  done
  rm -f "$pid"
}

case ${1:-} in
  install) shift && install "$@" ;;
  serve) shift && serve "$@" ;;
  test) shift && run_tests "$@" ;;
  programs) shift && run_programs "$@" ;;
  stop) stop ;;
  *) fail "the first argument is ${1:-missing}: must be install, serve, test, programs or stop" ;;
esac
