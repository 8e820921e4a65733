/* SPDX-License-Identifier: Apache-2.0
 * The roles of N instances, two or three, of the compensation (common/service/instance_sync.h), for SPIN.
 *
 * An instance is away, behind or in sync. Its answers are of a line, which goes on from instance to
 * instance with the state; a line is long or short. What an instance has heard of another may be
 * old: the other may have fallen behind or died since. Faults, bounded by a budget: a death (of one
 * beside which another is in sync), a link that fails in one direction, an instance whose answers
 * begin to differ from its line's. Silence is a step of its own: nothing is heard any more of one
 * that doesn't write, or that is cut off.
 *
 * Held by any order of the steps:
 * - When the faults are over, all are in sync and of one line (at timeout).
 * - It always comes to that: nobody falls behind and catches up for ever (pan -DNP, -l).
 */
#define AWAY 0
#define BEHIND 1
#define SYNC 2
#define NONE 255
#ifndef N
#define N 2
#define DEATHS 1
#define FAILURES 1
#define DIVERGENCES 1
#endif
#if N == 3
#define OR_THIRD(condition) || (condition)
#define AND_THIRD(condition) && (condition)
#else
#define OR_THIRD(condition)
#define AND_THIRD(condition)
#endif

byte state[N];
byte line[N];
bool is_long[N];
bool cut[N * N];      /* from * N + to */
byte heard[N * N];    /* at * N + of: the line that was heard last, or NONE */
bool heard_long[N * N];
byte given[N];        /* on its way to this one: a line, or NONE */
bool given_long[N];
byte lines = 0;
byte deaths = DEATHS;
byte failures = FAILURES;
byte divergences = DIVERGENCES;

/* of i, hearing j: by what was heard */
#define AT(i, j) ((i) * N + (j))
#define IS_SENIOR(j, i) ((heard_long[AT(i, j)] && !is_long[i]) || \
                         (heard_long[AT(i, j)] == is_long[i] && j < i))
#define WRITES_TO(j, i) (i != j && state[j] == SYNC && !cut[AT(j, i)])
#define HEARS_NOBODY(i) (heard[AT(i, 0)] == NONE && heard[AT(i, 1)] == NONE AND_THIRD(heard[AT(i, 2)] == NONE))
#define IS_WRITTEN_TO(i) (WRITES_TO(0, i) || WRITES_TO(1, i) OR_THIRD(WRITES_TO(2, i)))
#define ANOTHER_IN_SYNC(i) \
  ((i != 0 && state[0] == SYNC) || (i != 1 && state[1] == SYNC) OR_THIRD(i != 2 && state[2] == SYNC))

/* What i and another one do. */
#define BETWEEN(i, j) \
  /* it hears what the other writes */ \
  :: atomic { \
       (state[i] != AWAY && WRITES_TO(j, i) && \
        (heard[AT(i, j)] != line[j] || heard_long[AT(i, j)] != is_long[j])) -> \
       heard[AT(i, j)] = line[j]; heard_long[AT(i, j)] = is_long[j] \
     } \
  /* silence, of one that doesn't write or is cut off */ \
  :: atomic { \
       (heard[AT(i, j)] != NONE && !WRITES_TO(j, i)) -> \
       heard[AT(i, j)] = NONE; heard_long[AT(i, j)] = false \
     } \
  /* one that is heard gives its state, if it is there and in sync when it is asked */ \
  :: atomic { \
       (i != j && state[i] == BEHIND && given[i] == NONE && heard[AT(i, j)] != NONE && \
        state[j] == SYNC && !cut[AT(i, j)] && !cut[AT(j, i)]) -> \
       given[i] = line[j]; given_long[i] = is_long[j] \
     } \
  /* of two that differ, the junior falls behind */ \
  :: atomic { \
       (i != j && state[i] == SYNC && heard[AT(i, j)] != NONE && heard[AT(i, j)] != line[i] && \
        IS_SENIOR(j, i)) -> \
       state[i] = BEHIND \
     } \
  :: atomic { (i != j && failures > 0 && !cut[AT(i, j)]) -> failures--; cut[AT(i, j)] = true } \
  :: atomic { cut[AT(i, j)] -> cut[AT(i, j)] = false }

proctype instance(byte i) {
  do
  BETWEEN(i, 0)
  BETWEEN(i, 1)
#if N == 3
  BETWEEN(i, 2)
#endif
  /* the only one, as far as it hears */
  :: atomic {
       (state[i] == BEHIND && HEARS_NOBODY(i) && !IS_WRITTEN_TO(i)) ->
       state[i] = SYNC;
       if
       :: line[i] == NONE -> line[i] = lines; lines++
       :: else -> skip
       fi
     }
  /* its line grows long */
  :: atomic { (state[i] == SYNC && !is_long[i]) -> is_long[i] = true }
  /* a state arrives; what was heard before says nothing about it */
  :: atomic {
       (given[i] != NONE) ->
       if
       :: state[i] == BEHIND ->
          state[i] = SYNC; line[i] = given[i]; is_long[i] = given_long[i];
          heard[AT(i, 0)] = NONE; heard[AT(i, 1)] = NONE;
          heard_long[AT(i, 0)] = false; heard_long[AT(i, 1)] = false;
#if N == 3
          heard[AT(i, 2)] = NONE; heard_long[AT(i, 2)] = false
#endif
       :: else -> skip
       fi;
       given[i] = NONE; given_long[i] = false
     }
  /* faults */
  :: atomic {
       (deaths > 0 && state[i] != AWAY && ANOTHER_IN_SYNC(i)) ->
       deaths--; state[i] = AWAY; line[i] = NONE; is_long[i] = false; given[i] = NONE;
       given_long[i] = false;
       heard[AT(i, 0)] = NONE; heard[AT(i, 1)] = NONE;
       heard_long[AT(i, 0)] = false; heard_long[AT(i, 1)] = false;
#if N == 3
       heard[AT(i, 2)] = NONE; heard_long[AT(i, 2)] = false
#endif
     }
  :: atomic { (state[i] == AWAY) -> state[i] = BEHIND }
  :: atomic { (divergences > 0 && state[i] == SYNC) -> divergences--; line[i] = lines; lines++ }
  od
}

init {
  byte i = 0;
  atomic {
    do
    :: i < N * N -> heard[i] = NONE; i++
    :: else -> break
    od;
    i = 0;
    do
    :: i < N -> state[i] = BEHIND; line[i] = NONE; given[i] = NONE; i++
    :: else -> break
    od;
    run instance(0); run instance(1);
#if N == 3
    run instance(2)
#endif
  }
  timeout ->  /* nothing is left to happen */
  assert(state[0] == SYNC && state[1] == SYNC AND_THIRD(state[2] == SYNC));
  assert(line[0] == line[1] AND_THIRD(line[1] == line[2]))
}
