#!/usr/bin/env bash
# browser_test.sh PROGRAM FOLDER   has PROGRAM report on browser_test.json, on a part of it without timing, on many_cells.json and
# on a history from which cells went and on results of other samples, and a real browser read the pages
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
program=$1 folder=$2
export NULLMARK_PROGRAM=$program
mkdir -p "$folder"
code=0
for name in browser_test untimed many_cells; do
  config=$name options=()
  [ $name != untimed ] || config=browser_test options=(--no-timing --filter '^depth')
  "$program" run "$here/$config.json" "${options[@]}" -o "$folder/$name.json" --force >/dev/null 2>"$folder/$name.log" || { tail -1 "$folder/$name.log" >&2; exit 1; }
  "$program" report "$folder/$name.json" -o "$folder/$name.html"
  /usr/bin/python3 -B "$here/browser_test.py" "$folder/$name.html" "$folder/$name.json" || code=$?
  [ "$code" -eq 0 ] || exit "$code"
done

sed 's/"optical_depth": \[0.5, 1, 2, 4\]/"optical_depth": [0.5, 1, 2]/' "$here/browser_test.json" >"$folder/fewer_depths.config.json"
"$program" run "$here/browser_test.json" --no-timing -o "$folder/all_depths.json" --force >/dev/null 2>&1
"$program" run "$folder/fewer_depths.config.json" --no-timing -o "$folder/fewer_depths.json" --force >/dev/null 2>&1
"$program" report "$folder/all_depths.json" "$folder/fewer_depths.json" -o "$folder/history.html"
/usr/bin/python3 -B "$here/browser_test.py" "$folder/history.html" "$folder/all_depths.json" "$folder/fewer_depths.json"

sed 's/"samples_per_ray": 256/"samples_per_ray": 1048576/' "$here/browser_test.json" >"$folder/more_samples.config.json"
"$program" run "$here/browser_test.json" --filter '^depth' -o "$folder/few_samples.json" --force >/dev/null 2>&1
"$program" run "$folder/more_samples.config.json" --filter '^depth' -o "$folder/more_samples.json" --force >/dev/null 2>&1
"$program" report "$folder/few_samples.json" "$folder/more_samples.json" -o "$folder/other_samples.html"
/usr/bin/python3 -B "$here/browser_test.py" "$folder/other_samples.html" "$folder/few_samples.json" "$folder/more_samples.json"
