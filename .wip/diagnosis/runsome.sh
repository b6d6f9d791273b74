#!/bin/bash
# runsome BIN SET OUT CASES...
echo -14 > /proc/self/autogroup
BIN=$1; SET=$2; OUT=$3; shift 3; mkdir -p $OUT
python3 /tmp/patchscan.py $SET $OUT >/dev/null
for n in "$@"; do c=$SET/cases/$n; [ -f $OUT/$n.json ] && continue; [ -f $SET/labels/$n.json ] || continue
  mkdir $OUT/$n.lock 2>/dev/null || continue
  last=$(ls $c/trials/*.csv | tail -1 | xargs basename | sed 's/.csv//; s/^0*//')
  timeout 400 $BIN $c ${last:-0} $OUT/$n.tmp > $OUT/$n.log 2>&1 && mv $OUT/$n.tmp $OUT/$n.json
done
