#!/usr/bin/env bash
# A fake glove from end to end, as a CI job runs it: emulator, daemon, client, recording. Ends with 0 if all of it works.
#   deploy/ci.sh [FOLDER OF THE PROGRAMS]        the path is searched without one
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
if [ $# -gt 0 ]; then PATH=$(cd "$1" && pwd):$PATH; fi
port=${TSUKAMU_CI_PORT:-7448}
work=$(mktemp -d)
emulator= daemon=
end() {
  # The daemon first: it is not to report a glove that is lost.
  for process in $daemon $emulator; do
    kill "$process" 2>/dev/null || true
    wait "$process" || true
  done
  rm -rf "$work"
}
trap end EXIT
client() { tsukamu --address "127.0.0.1:$port" --wait 30 "$@"; }

tsukamud emulate hand --motion free --link "$work/tsukamu" >/dev/null & emulator=$!
sed "s|/tmp/|$work/|" "$here/emulated.toml" > "$work/settings.toml"
tsukamud check "$work/settings.toml"
tsukamud --config "$work/settings.toml" --listen "127.0.0.1:$port" --recording-dir "$work/recordings" >/dev/null & daemon=$!

client status
# Glove, tracker and the hand of both.
for _ in $(seq 60); do
  running=$(client devices --json | { grep -o '"state":"running"' || true; } | wc -l)
  if [ "$running" -ge 3 ]; then break; fi
  sleep 0.5
done
client devices
if [ "$running" -lt 3 ]; then echo "glove and tracker do not run" >&2; exit 1; fi

client record start ci
client watch --plain --count 120 >/dev/null
client record stop
tsukamud verify "$work/recordings/ci.mcap"
