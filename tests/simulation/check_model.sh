#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# check_model.sh FOLDER [INSTANCES DEATHS FAILURES DIVERGENCES]: instance_sync.pml by SPIN, in FOLDER. No state may break an
# assertion, and no cycle may go on for ever.
set -eu
model=$(cd "$(dirname "$0")" && pwd)/instance_sync.pml
faults="-DN=${2:-2} -DDEATHS=${3:-1} -DFAILURES=${4:-1} -DDIVERGENCES=${5:-1}"
mkdir -p "$1"
cd "$1"
spin $faults -a "$model"
gcc -O1 -w -DSAFETY -DCOLLAPSE -DNOFAIR -o safety pan.c
gcc -O1 -w -DNP -DCOLLAPSE -DNOFAIR -o progress pan.c
./safety -E -m1000000 -w22 | tee safety.txt
grep -q 'errors: 0' safety.txt
./progress -E -l -m1000000 -w22 | tee progress.txt
grep -q 'errors: 0' progress.txt
! grep -h 'Search not completed\|max search depth too small' safety.txt progress.txt
