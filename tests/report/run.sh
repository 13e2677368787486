#!/bin/sh
# run.sh LLMT LLMT_ROBOT ROBOTS PACKAGES CHROMIUM FOLDER: makes a report by every command, from data made here, and looks at
# each in a browser (look.mjs).
set -eu
llmt=$1 robot=$2 robots=$3 packages=$4 chromium=$5 folder=$6
here=$(cd "$(dirname "$0")" && pwd)
rm -rf "$folder" && mkdir -p "$folder" && cd "$folder"

awk 'function uniform() { s = (s * 16807) % 2147483647; return s / 2147483647 }
     function normal(  k, sum) { for (k = 0; k < 12; ++k) sum += uniform(); return sum - 6 }
     BEGIN {
       s = 1
       print "pressure,temperature,flow" > "two.csv"
       print "a,b,c,kind,y,z" > "many.csv"
       print "minute,load,power" > "simulated.csv"
       print "minute,load,power" > "measured.csv"
       for (i = 0; i < 600; ++i) {
         p = 10 * uniform(); t = 100 * uniform()
         printf "%.4f,%.4f,%.4f\n", p, t, 3 * p + (t > 60 ? 8 : 0) + (p > 6 ? 2 * (p - 6) : 0) + 0.5 * normal() > "two.csv"
       }
       for (i = 0; i < 4000; ++i) {
         a = 10 * uniform(); b = normal(); c = uniform(); k = substr("xyz", 1 + int(3 * uniform()), 1)
         y = 3 * sin(a) + (c > 0.5 ? b * b : 0) + (k == "y" ? 2 : 0) + 0.3 * normal()
         printf "%.4f,%s,%.4f,<b>%s</b>,%.4f,%.4f\n", a, i % 50 ? b : "", c, k, y, a - b > "many.csv"
       }
       for (i = 0; i < 200; ++i) {
         load = 10 * uniform(); power = 5 + 0.8 * load
         printf "%d,%.4f,%.4f\n", i, load, power > "simulated.csv"
         printf "%d,%.4f,%.4f\n", i, load, power + 0.6 * exp(-i / 25) + 0.3 * (load > 6.5) + 0.04 * normal() > "measured.csv"
       }
     }'
# Effects that the description does not have.
sed '/^effects:/,$d' "$robots/planar_two_link.yaml" > rigid.yaml
"$robot" simulate "$robots/planar_two_link.yaml" --poses 300 --noise-um 20 -o planar.csv >/dev/null
"$robot" simulate "$robots/ur10.yaml" --poses 150 --noise-um 20 -o ur10.csv >/dev/null

make() { echo "$*" >&2; "$@" >/dev/null; }
make "$llmt" fit two.csv --target flow --report fit_two.html
make "$llmt" fit many.csv --target y,z --report fit_many.html
make "$llmt" fit two.csv --target flow --cv 0 --report fit_no_folds.html
make "$llmt" compare two.csv --target flow --report compare.html
make "$llmt" discover simulated.csv measured.csv --target power --report discover.html
make "$robot" calibrate "$robots/ur10.yaml" ur10.csv --correct --report calibrate.html
make "$robot" calibrate rigid.yaml planar.csv --folds 0 --report calibrate_planar.html
make "$robot" discover rigid.yaml planar.csv --report robot_discover.html
make "$robot" discover "$robots/ur10.yaml" ur10.csv --report nothing_missing.html
make "$robot" paper --report paper.html
make "$robot" paper --study tx200 --seeds 3 --report tx200.html
exec node "$here/look.mjs" "$packages" "$chromium" *.html --shots shots
