#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Counts samples in a recording of tests/containers: what a subscriber really got, by sequence number.

    samples.py first FILE --since T                    seconds from T to the first compensated sample
    samples.py exact FILE [--from T] [--to T] [--at-least N] [--lost-with-gyro]
        every raw sample that arrived in the time was answered by exactly one compensated sample, and none is missing
        in between; sequence numbers that begin anew are a publisher that began anew
    samples.py gap FILE --from T --to T --at-most S     longest silence of compensated_rate

Times are seconds since 1970, as `date +%s.%N` gives them. One line of figures; exit code 1: the answer is no. A recording that is
still being written is waited for until both topics are past the end of the time. Recordings as `zerodrift record --compression none`
writes them: MCAP (https://mcap.dev/spec), messages in CDR.
"""
import argparse
import os
import struct
import sys
import time
from collections import Counter

CHANNEL, MESSAGE, CHUNK = 0x04, 0x05, 0x06
CDR_HEADER = 4
STILL_S = 20  # a recording that doesn't get on for so long doesn't get on any more
SEQUENCE_AT = CDR_HEADER + 8  # behind gyro_id and validity, in both types (idl/dds)


def records(data, at, end):
    while at + 9 <= end:
        opcode, length = data[at], struct.unpack_from("<Q", data, at + 1)[0]
        at += 9
        if at + length > end:
            return  # the file is still being written
        yield opcode, at, at + length
        at += length


def text(data, at):
    length = struct.unpack_from("<I", data, at)[0]
    return data[at + 4 : at + 4 + length].decode(), at + 4 + length


def read(path):
    """{topic: [(arrival in s, sequence number), ...]} in order of arrival."""
    data = open(path if os.path.exists(path) else path + ".active", "rb").read()  # the recorder renames it at its end
    topics, samples = {}, {"angular_rate": [], "compensated_rate": []}

    def take(begin, end):
        for opcode, at, stop in records(data, begin, end):
            if opcode == CHANNEL:
                topics[struct.unpack_from("<H", data, at)[0]] = text(data, at + 4)[0]
            elif opcode == MESSAGE:
                channel, _, log_time = struct.unpack_from("<HIQ", data, at)
                of_topic = samples.get(topics.get(channel))
                if of_topic is not None:
                    of_topic.append((log_time * 1e-9, struct.unpack_from("<Q", data, at + 22 + SEQUENCE_AT)[0]))
            elif opcode == CHUNK:
                compression, after = text(data, at + 28)
                if compression:
                    sys.exit(f"{path}: chunks are compressed ({compression}); record with --compression none")
                take(after + 8, stop)

    take(8, len(data))
    return samples


def is_past(samples, end):
    return all(stream and stream[-1][0] > end for stream in samples.values())


def read_past(path, end):
    """As read(), once the recording is past `end`; as it is where it ended before, or doesn't get on."""
    given_up = time.monotonic() + STILL_S
    while True:
        is_written = not os.path.exists(path)  # looked at first: what is read then is the whole
        samples = read(path)
        if not is_written or is_past(samples, end) or time.monotonic() > given_up:
            return samples
        time.sleep(0.1)


def runs(stream):
    """Splits where the source began anew: where a sequence number falls far back, not by one late sample."""
    of_all, last = [[]], None
    for arrival, sequence in stream:
        if last is not None and sequence + 200 < last:
            of_all.append([])
            last = None
        of_all[-1].append((arrival, sequence))
        last = sequence if last is None else max(last, sequence)
    return of_all


def exact(samples, begin, end, at_least, lost_with_gyro):
    raw_runs, answer_runs = runs(samples["angular_rate"]), runs(samples["compensated_rate"])
    if len(raw_runs) != len(answer_runs):
        return False, f"{len(raw_runs)} runs of the publisher, {len(answer_runs)} of answers"
    raw_count = missing = doubled = never_sent = unheard = 0
    for raw, answers in zip(raw_runs, answer_runs):
        raw_times = Counter(sequence for _, sequence in raw)
        answer_times = Counter(sequence for _, sequence in answers)
        # The recorder met one topic before the other, and let go of one before the other.
        low = max(min(raw_times), min(answer_times))
        high = min(max(raw_times), max(answer_times))
        arrived = dict(reversed([(sequence, arrival) for arrival, sequence in raw]))
        wanted = [s for s, arrival in arrived.items() if low <= s <= high and begin <= arrival <= end]
        raw_count += len(wanted)
        missing += sum(1 for s in wanted if not answer_times[s])
        doubled += sum(answer_times[s] - 1 for s in wanted if answer_times[s] > 1) + sum(raw_times[s] - 1 for s in wanted)
        if wanted:
            never_sent += max(wanted) - min(wanted) + 1 - len(wanted)
            unheard += sum(1 for s in answer_times if min(wanted) <= s <= max(wanted) and s not in raw_times)
    heard = [arrival for arrival, _ in samples["angular_rate"] if begin <= arrival <= end]
    silence = max((b - a for a, b in zip(heard, heard[1:])), default=0.0)
    line = (f"{raw_count} raw, longest silence {silence:.3f} s, {missing} unanswered, {doubled} doubled, {never_sent} raw missing, "
            f"{len(raw_runs)} run(s) of the publisher")
    good = not missing and not doubled and raw_count >= at_least and (lost_with_gyro or not never_sent) and not unheard
    return good, line


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("question", choices=["first", "exact", "gap"])
    parser.add_argument("file")
    parser.add_argument("--since", type=float)
    parser.add_argument("--from", dest="begin", type=float, default=0.0)
    parser.add_argument("--to", dest="end", type=float, default=float("inf"))
    parser.add_argument("--at-least", type=int, default=1)
    parser.add_argument("--at-most", type=float)
    parser.add_argument("--lost-with-gyro", action="store_true")
    options = parser.parse_args()
    samples = read(options.file) if options.end == float("inf") else read_past(options.file, options.end)
    arrivals = [arrival for arrival, _ in samples["compensated_rate"]]
    if options.question == "first":
        if not arrivals:
            sys.exit("no compensated sample")
        print(f"{arrivals[0] - options.since:.2f}")
    elif options.question == "gap":
        inside = [t for t in arrivals if options.begin <= t <= options.end]
        marks = [options.begin, *inside, options.end]
        longest = max(b - a for a, b in zip(marks, marks[1:]))
        print(f"longest silence {longest:.3f} s, {len(inside)} samples")
        return 0 if longest <= options.at_most else 1
    else:
        if not samples["angular_rate"] or not arrivals:
            print(f"{len(samples['angular_rate'])} raw, {len(arrivals)} compensated")
            return 1
        good, line = exact(samples, options.begin, options.end, options.at_least, options.lost_with_gyro)
        print(line)
        return 0 if good else 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
