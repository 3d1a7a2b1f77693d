#!/bin/bash
# Kills runs at random moments and counts what a resumed run makes of them:
#
#   scripts/crash_test.sh [N]        N kills, 1000 if not given; SEED=3 for other moments
#
# A run saves after each frame, and keeps an atlas with a submap every other frame. After each kill
# map.pmap and the atlas have to be readable, and --resume goes on; each run that comes to its end
# has to leave the bytes of an uninterrupted one, and the rows of its atlas. Every other run
# overwrites (--force) the result of the run before. Says how many kills came while a result was
# saved (.saving or .saved is there), and how many met a run that was resumed. Ends with code 1 if
# anything was wrong.
set -euo pipefail

kills=${1:-1000}
root=$(cd "$(dirname "$0")/.." && pwd)
tool=${PLANAR_MAP:-$root/build/bin/planar_map}
RANDOM=${SEED:-1}
work=$(mktemp -d)
done_kills=0; in_save=0; in_resume=0; unreadable=0; wrong=0; refused=0; finished=0
finish() {
  echo "$done_kills kills, $in_save of them while a result was saved, $in_resume in resumed runs;" \
    "$finished runs finished: $unreadable unreadable maps or atlases, $wrong wrong results, $refused runs" \
    "that could not be resumed"
  kill -9 "${child:-}" 2> /dev/null || true
  wait
  rm -rf "$work"
}
trap finish EXIT
trap 'exit 130' INT TERM

"$tool" simulate corridor --frames 8 --step 0.3 --width 80 --height 60 -o "$work/input" -q
run() {  # in a sub-shell, which becomes the program
  exec "$tool" run "$root/config/pcd_sequence.yaml" -i "$work/input" --checkpoint 0 -q \
    --atlas "$2.atlas" --submap-frames 2 "$@" > "$work/out.txt" 2>&1
}
# What has to be the same: all but times and memory.
results() {
  sha256sum < "$1/map.pmap"
  sha256sum < "$1/map.json"
  sha256sum < "$1/trajectory_tum.txt"
  # A finished run that nothing was done in has the atlas it had.
  [ -e "$1.atlas" ] || cp "$work/whole.atlas" "$1.atlas"
  "$tool" atlas merge "$1.atlas" -o "$work/rows.atlas" --force
  sha256sum < "$work/rows.atlas"
  sed -e '/"time_ms"/,$d' -e '/"memory_bytes"/d' "$1/metrics.json"
}
# Changes with each operation in these folders: what an earlier run left there does not count.
saving() { stat -c '%n %i %z' "$work"/out/.sav{ing,ed} 2> /dev/null || true; }

begin=$(date +%s%N)
(run -o "$work/whole")
longest_us=$(( ($(date +%s%N) - begin) / 1000 ))
results "$work/whole" > "$work/expected"

options=()
while [ "$done_kills" -lt "$kills" ]; do
  left=$(saving)
  (run -o "$work/out" "${options[@]}") & child=$!
  moment=$(( (RANDOM * 32768 + RANDOM) % longest_us ))
  sleep "$((moment / 1000000)).$(printf '%06d' $((moment % 1000000)))"
  if kill -9 "$child" 2> /dev/null; then
    longest_us=$((longest_us * 21 / 20))
  else  # the machine has become faster: most runs are to be killed
    longest_us=$((longest_us * 9 / 10))
  fi
  code=0; wait "$child" 2> /dev/null || code=$?
  if [ "$code" -eq 137 ]; then
    done_kills=$((done_kills + 1))
    now=$(saving)
    if [ -n "$now" ] && [ "$now" != "$left" ]; then in_save=$((in_save + 1)); fi
    if [ "${options[*]}" = --resume ]; then in_resume=$((in_resume + 1)); fi
  fi
  if [ -e "$work/out/map.pmap" ] && ! "$tool" info "$work/out/map.pmap" > /dev/null 2>&1; then
    unreadable=$((unreadable + 1))
  fi
  if [ -e "$work/out.atlas" ] && ! "$tool" atlas info "$work/out.atlas" > /dev/null 2>&1; then
    unreadable=$((unreadable + 1))
  fi
  options=(--resume)
  if [ "$code" -eq 0 ]; then
    finished=$((finished + 1))
    results "$work/out" > "$work/found"
    cmp -s "$work/expected" "$work/found" || wrong=$((wrong + 1))
    if [ $((finished % 2)) -eq 0 ]; then rm -rf "$work/out"; options=(); else options=(--force); fi
    rm -f "$work"/out.atlas*
  elif [ "$code" -ne 137 ]; then
    refused=$((refused + 1))
    cat "$work/out.txt"
    rm -rf "$work/out" "$work"/out.atlas*; options=()
  fi
done
[ $((unreadable + wrong + refused)) -eq 0 ]
