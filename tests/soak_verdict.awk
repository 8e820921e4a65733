# SPDX-License-Identifier: Apache-2.0
# Judges what tests/soak.sh measured. Input: its samples.csv; -v warm_up_s=S: sensor time from which on nothing may grow.
# A line a process, then PASS or FAIL with reasons. Exit code 0, 1, or 2 where there is too little to judge by.
#
# Resident memory may grow by 2 %, at least 4 MB: relearning with another kernel holds a second kernel matrix for a while
# (500 x 500 doubles: 2 MB), and the allocator and the middleware's pools keep what they once needed. At 200 Hz a leak of one
# byte a sample is 0.7 MB an hour of sensor time, so that 6 h show it. Growth is of means over a tenth of the time judged, the
# last against the first, so that one short peak at either end doesn't decide. Files, threads and shared memory have no such
# reason: not one more than at the beginning.
#
# Resident memory also grows where a process first touches what it asked for long ago: the rows of an online SVR are committed
# page by page as its margin set has new largest sizes (DECISIONS.md 89). What a process has asked for (VmData) doesn't grow by
# that. From an hour and half of the run on, when every axis has selected its kernel, it may grow by
# 1 MB, the step of an allocator's arena and of the middleware's pools. The smallest of a tenth of the samples counts: a state
# that is handed over holds 2 to 4 MB for seconds and gives them back.
function fail(reason) { reasons = reasons "  " reason "\n"; failed = 1 }
function rises(process, what, begin, most) {
  if (most > begin) fail(process ": " what " rose from " begin " to " most)
}
function smallest_asked(process, from, to,   smallest, row) {
  smallest = asked_kb[process, from]
  for (row = from + 1; row <= to; ++row) if (asked_kb[process, row] < smallest) smallest = asked_kb[process, row]
  return smallest
}
BEGIN { FS = ","; allowed_share = 0.02; allowed_kb = 4096; asked_allowed_kb = 1024; fewest = 4 }
NR == 1 { next }
$2 + 0 < warm_up_s { next }
{
  name = $3
  if (!(name in rows)) {
    order[++processes] = name
    begin_fds[name] = most_fds[name] = $5; begin_threads[name] = most_threads[name] = $6
    begin_shm[name] = most_shm[name] = $8; begin_bytes[name] = most_bytes[name] = $9
    begin_s[name] = $2; begin_cpu[name] = $7; begin_wall[name] = $1
  }
  n = ++rows[name]
  kb[name, n] = $4; at_s[name, n] = $2; asked_kb[name, n] = $11
  sum_x[name] += $2; sum_y[name] += $4; sum_xx[name] += $2 * $2; sum_xy[name] += $2 * $4
  if ($5 > most_fds[name]) most_fds[name] = $5
  if ($6 > most_threads[name]) most_threads[name] = $6
  if ($8 > most_shm[name]) most_shm[name] = $8
  if ($9 > most_bytes[name]) most_bytes[name] = $9
  cpu[name] = $7 - begin_cpu[name]; wall[name] = $1 - begin_wall[name]
}
END {
  printf "%-18s %9s %9s %11s %9s %6s %8s %9s %6s\n", "from " warm_up_s " s on", "begin MB", "end MB", "slope kB/h", "asked MB",
         "files", "threads", "shm names", "cpu %"
  for (p = 1; p <= processes; ++p) {
    name = order[p]; n = rows[name]
    if (n < fewest) { print "soak: " name ": found " n " samples after the warm-up, expected " fewest; exit 2 }
    tenth = int(n / 10); if (tenth < 1) tenth = 1
    first = last = 0
    for (k = 1; k <= tenth; ++k) { first += kb[name, k] / tenth; last += kb[name, n + 1 - k] / tenth }
    spread = n * sum_xx[name] - sum_x[name] ^ 2
    slope = spread > 0 ? 3600 * (n * sum_xy[name] - sum_x[name] * sum_y[name]) / spread : 0
    load_percent = 0; if (wall[name] > 0) load_percent = 100 * cpu[name] / wall[name]
    printf "%-18s %9.2f %9.2f %11.1f %9.2f %6d %8d %9d %6.0f\n", name, first / 1024, last / 1024, slope,
           asked_kb[name, n] / 1024, most_fds[name], most_threads[name], most_shm[name], load_percent
    allowed = allowed_share * first; if (allowed < allowed_kb) allowed = allowed_kb
    if (last - first > allowed)
      fail(sprintf("%s: resident memory grew by %.2f MB, allowed are %.2f", name, (last - first) / 1024, allowed / 1024))
    settled_s = at_s[name, n] / 2 > 3600 ? at_s[name, n] / 2 : 3600
    for (k = 1; k <= n && at_s[name, k] < settled_s; ++k);
    if (k > n) k = n
    asked_more_kb = smallest_asked(name, n + 1 - tenth, n) - smallest_asked(name, k, k + tenth - 1 < n ? k + tenth - 1 : n)
    if (asked_more_kb > asked_allowed_kb)
      fail(sprintf("%s: from %d s on it asked for %.2f MB more, allowed are %.2f", name, settled_s,
                   asked_more_kb / 1024, asked_allowed_kb / 1024))
    rises(name, "the number of open files", begin_fds[name], most_fds[name])
    rises(name, "the number of threads", begin_threads[name], most_threads[name])
    rises(name, "the number of shared-memory names", begin_shm[name], most_shm[name])
    rises(name, "shared memory in bytes", begin_bytes[name], most_bytes[name])
  }
  if (processes == 0) { print "soak: found no samples after the warm-up"; exit 2 }
  if (failed) printf "%s", reasons
  exit failed
}
