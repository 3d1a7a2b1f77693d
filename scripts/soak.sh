#!/bin/bash
# Maps simulated frames of changing scenes, undisturbed and disturbed, and compares:
#
#   scripts/soak.sh [FRAMES]         FRAMES in all, 20000 if not given; SEED=3 for other moments
#
# Each round is a scene of 1000 frames, some of them thin, seen twice around where the scene is a room.
# The disturbed run is killed at random moments and resumed; in every other round the frames come
# from a front-end in another process, which is killed as well; in the others a file is damaged and
# mended once the run has refused it. Its map has to have the bytes of the undisturbed one. Prints
# for each kind of scene the time of a frame in the last quarter of the undisturbed run to that of the
# same frames in a map of their own, and its memory then to that in the second quarter: on the way
# back, or the second time around in a room, the same is seen again.
# Ends with code 1 if a map differs or a run cannot be resumed.
set -euo pipefail

frames=${1:-20000}
root=$(cd "$(dirname "$0")/.." && pwd)
tool=${PLANAR_MAP:-$root/build/bin/planar_map}
config=$root/config/pcd_sequence.yaml
RANDOM=${SEED:-1}
round_frames=1000
work=$(mktemp -d)
done_frames=0; kills=0; wrong=0; stuck=0; damaged=0; peak=0
: > "$work/growth"
finish() {
  awk -v frames="$done_frames" -v kills="$kills" -v damaged="$damaged" -v wrong="$wrong" \
    -v stuck="$stuck" -v peak="$peak" '{ n[$1]++; time[$1] += $2; memory[$1] += $3 } END {
      printf "%d frames, %d kills, %d damaged files: %d wrong maps, %d runs that could not be " \
        "resumed; peak memory %d MB", frames, kills, damaged, wrong, stuck, peak / 1024
      if (NR) printf "; last quarter:"
      for (s in n) printf " %s: time a frame %.2f, memory %.2f;", s, time[s] / n[s], memory[s] / n[s]
      print "" }' "$work/growth"
  rm -rf "$work"
}
trap finish EXIT
trap 'exit 130' INT TERM

pause() { sleep "0.$(printf '%03d' $((RANDOM % 700)))"; }
results() { cat "$1/map.pmap" "$1/map.json" "$1/trajectory_tum.txt" | sha256sum; }

# Runs without disturbance and watches memory. $1 = kind of scene
undisturbed() {
  "$tool" run "$config" -i "$work/in" -o "$work/whole" -q > "$work/out.txt" 2>&1 &
  local child=$! memory=0
  : > "$work/rss"
  while kill -0 "$child" 2> /dev/null; do
    awk '/VmRSS/ { print $2 }' "/proc/$child/status" >> "$work/rss" 2> /dev/null || true
    sleep 0.05
  done
  wait "$child"
  memory=$(sort -n "$work/rss" | tail -1)
  [ "${memory:-0}" -le "$peak" ] || peak=$memory
  times() {  # a frame, of run $1, from line $2 on
    awk -F, -v from="$2" 'NR == 1 { for (i = 1; i <= NF; i++) if ($i == "frame_ms") column = i }
                          NR > from { print $column }' "$1/frames.csv"
  }
  quarter() {  # number $1 of the memory
    awk -v q="$1" '{ v[NR] = $1 } END { for (i = int(NR * (q - 1) / 4) + 1; i <= NR * q / 4; i++) print v[i] }' "$work/rss"
  }
  median() { sort -n | awk '{ v[NR] = $1 } END { print NR ? v[int((NR + 1) / 2)] : 1 }'; }
  rm -rf "$work/fresh"  # the last quarter again, into a map of its own
  "$tool" run "$config" -i "$work/in" -o "$work/fresh" -q --frames "$((round_frames * 3 / 4)):" > "$work/out.txt" 2>&1
  echo "$(times "$work/whole" "$((round_frames * 3 / 4 + 1))" | median) $(times "$work/fresh" 1 | median)" \
    "$(quarter 4 | median) $(quarter 2 | median)" |
    awk -v scene="$1" '{ print scene, $1 / $2, $3 / $4 }' >> "$work/growth"
}

# Kills a mapping side, and with $1 = network its front-end, until they have come to the end.
disturbed() {
  local network=$1 options=() code=0 mapper='' sender='' tries=0
  local victim=$work/in/clouds/000$((100 + RANDOM % 100)).pcd
  if [ "$network" = no ]; then
    cp "$victim" "$work/victim"; truncate -s $((RANDOM % 900)) "$victim"; damaged=$((damaged + 1))
  fi
  while true; do
    tries=$((tries + 1))
    if [ "$network" = yes ]; then
      "$tool" run "$config" --listen "ipc://$work/socket" --timeout 20 -o "$work/out" --checkpoint 0.2 -q \
        "${options[@]}" > "$work/out.txt" 2>&1 & mapper=$!
      "$tool" frontend -i "$work/in" --connect "ipc://$work/socket" -q > "$work/sender.txt" 2>&1 & sender=$!
    else
      "$tool" run "$config" -i "$work/in" -o "$work/out" --checkpoint 0.2 -q "${options[@]}" \
        > "$work/out.txt" 2>&1 & mapper=$!
    fi
    if [ "$tries" -le 4 ]; then
      pause
      if [ "$network" = yes ] && [ $((RANDOM % 2)) -eq 0 ]; then  # only the front-end: it comes back
        kill -9 "$sender" 2> /dev/null && kills=$((kills + 1))
        wait "$sender" 2> /dev/null || true
        "$tool" frontend -i "$work/in" --connect "ipc://$work/socket" -q > "$work/sender.txt" 2>&1 & sender=$!
        pause
      fi
      kill -9 "$mapper" 2> /dev/null && kills=$((kills + 1))
    fi
    code=0; wait "$mapper" 2> /dev/null || code=$?
    if [ "$network" = yes ]; then
      kill -9 "$sender" 2> /dev/null || true
      wait "$sender" 2> /dev/null || true
    fi
    case $code in
      0) return ;;
      137) ;;
      4) if [ "$network" = no ] && [ -e "$work/victim" ]; then
           mv "$work/victim" "$victim"
         else
           break
         fi ;;
      *) break ;;
    esac
    options=()
    [ ! -e "$work/out" ] || options=(--resume)
  done
  stuck=$((stuck + 1))
  cat "$work/out.txt"
}

round=0
scenes=(room corridor outdoor rooms)
while [ "$done_frames" -lt "$frames" ]; do
  rm -rf "$work/in" "$work/whole" "$work/out" "$work/victim"
  thin=()
  [ $((RANDOM % 3)) -gt 0 ] || thin=(--plain-share "0.$((RANDOM % 10))" --wrong-matches 0.02)
  scene=${scenes[$((round % 4))]}
  "$tool" simulate "$scene" --frames $round_frames --path return --moving --width 80 --height 60 \
    --noise-px 0.02 --seed "$RANDOM" --yaw-deg "$((RANDOM % 90))" "${thin[@]}" -o "$work/in" -q
  rm "$work/in/scene.json"
  undisturbed "$scene"
  disturbed "$([ $((round / 4 % 2)) -eq 0 ] && echo yes || echo no)"
  if [ ! -e "$work/out/map.pmap" ] || [ "$(results "$work/whole")" != "$(results "$work/out")" ]; then
    wrong=$((wrong + 1))
    echo "round $round: another map" >&2
  fi
  round=$((round + 1))
  done_frames=$((done_frames + round_frames))
done
[ $((wrong + stuck)) -eq 0 ]
