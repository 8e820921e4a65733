// SPDX-License-Identifier: Apache-2.0
// How every program of ours takes signals: SIGINT, SIGTERM and SIGHUP ask it to stop, SIGPIPE is an
// error of the write that met it.
#pragma once

#include <chrono>

namespace zerodrift::service {

// How long a program may leave a stop untaken: longer than any round of a main loop, whose stop
// then takes effect within 2 s.
inline constexpr std::chrono::milliseconds kStopIsTakenWithin{5000};

// Call once, before any thread is started: what threads inherit is set here. From then on only
// wait_for_stop() sees the stop signals; a program that never asks, or hangs, is ended by the
// signal after `taken_within`. SIGHUP stays ignored where it was (nohup). Opens /dev/null for
// each of the three standard descriptors that is closed, or the next file would become it.
void take_signals(std::chrono::milliseconds taken_within = kStopIsTakenWithin);
// True if a stop signal came within the time; takes it.
bool wait_for_stop(std::chrono::milliseconds at_most);
// While set, a stop is carried out at once: `end` is called with the signal's number by the thread
// that takes signals. Null: whoever waits for a stop is notified.
void end_at_once_by(void (*end)(int signal_number));
// Ends the running wait as a signal would; for tests and for sources that come to their end.
void request_stop();

}  // namespace zerodrift::service
