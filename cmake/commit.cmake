# SPDX-License-Identifier: Apache-2.0
# cmake -DSOURCE=DIR -DHEADER=FILE [-DGIVEN=COMMIT] -P commit.cmake: writes the commit of a checkout as ZERODRIFT_COMMIT into a
# header, which stays untouched while it is the same; "+" where tracked files differ, "unknown" outside of git. GIVEN is taken
# where the sources come without git's folder, as in the image's build.
cmake_minimum_required(VERSION 3.25)
set(commit ${GIVEN})
if(NOT commit)
  set(commit unknown)
  find_program(GIT git)
  # Not the commit of a repository that the sources merely lie in.
  if(GIT AND EXISTS ${SOURCE}/.git)
    execute_process(COMMAND ${GIT} --no-optional-locks -C ${SOURCE} describe --always --exclude=* --abbrev=7 --dirty=+
                    OUTPUT_VARIABLE found OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE status)
    if(status EQUAL 0)
      set(commit ${found})
    endif()
  endif()
endif()
file(CONFIGURE OUTPUT ${HEADER} CONTENT "#pragma once\n#define ZERODRIFT_COMMIT \"${commit}\"\n" @ONLY)
