# SPDX-License-Identifier: Apache-2.0
# Compiler settings and the three helpers every folder uses: one library, one test program, one service.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()

# Everything lands in one bin/ so that services, scripts and tests find each other by name.
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)

# Paths below the checkout are relative to the cache, so that it serves all checkouts.
find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM)
  set(CMAKE_CXX_COMPILER_LAUNCHER
      ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1 ${CCACHE_PROGRAM})
  set(CMAKE_C_COMPILER_LAUNCHER ${CMAKE_CXX_COMPILER_LAUNCHER})
endif()

# What nothing calls is left out of the programs, of the image's too.
add_compile_options($<$<CONFIG:Release>:-ffunction-sections> $<$<CONFIG:Release>:-fdata-sections>)
add_link_options($<$<CONFIG:Release>:LINKER:--gc-sections,-z,pack-relative-relocs>)

find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)

# Warnings are errors in our own code, never in generated code, and in the builds of the product: what another compiler says, or
# this one of a sanitizer's instrumentation, must not keep fuzzers and sanitizers from running.
add_library(zerodrift_warnings INTERFACE)
target_compile_options(zerodrift_warnings INTERFACE
  -Wall -Wextra -Wpedantic $<$<AND:$<CXX_COMPILER_ID:GNU>,$<BOOL:${ZERODRIFT_WARNINGS_ARE_ERRORS}>>:-Werror>
  -Wshadow -Wconversion -Wsign-conversion -Wdouble-promotion -Wold-style-cast
  -Wnull-dereference -Wcast-align -Wformat=2 -Wnon-virtual-dtor -Woverloaded-virtual)
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  target_compile_options(zerodrift_warnings INTERFACE
    -Wduplicated-cond -Wlogical-op
    -Wno-restrict)  # GCC 12 warns falsely on std::string concatenation (GCC bug 105651)
endif()

# Same input, same output, to the bit: no contraction into fused operations, never -ffast-math.
add_library(zerodrift_options INTERFACE)
target_compile_options(zerodrift_options INTERFACE -ffp-contract=off)
target_include_directories(zerodrift_options INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>)
target_compile_features(zerodrift_options INTERFACE $<INSTALL_INTERFACE:cxx_std_20>)

# Tests of services and topics wait for others and compute nothing: optimising them would take half of their compile time.
add_library(zerodrift_compiled_quickly INTERFACE)
target_compile_options(zerodrift_compiled_quickly INTERFACE $<$<CONFIG:Release>:-O0>)

# Commands, pages, reports and configuration do little, once: they are compiled for size, which halves them, in a third less time.
# What computes or carries samples is not; such a function must not be instantiated in these alone, since programs keep one copy.
add_library(zerodrift_compiled_small INTERFACE)
target_compile_options(zerodrift_compiled_small INTERFACE $<$<CONFIG:Release>:-Os>)

# zerodrift_library(<folder> SOURCES ... HEADERS ... [DEPENDS zerodrift::... other targets])
# makes target zerodrift_<folder>, alias zerodrift::<folder>. DEPENDS is the layer rule of that folder.
function(zerodrift_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;HEADERS;DEPENDS" ${ARGN})
  if(ARG_SOURCES)
    add_library(zerodrift_${name} STATIC ${ARG_SOURCES})
    set(scope PUBLIC)
    target_link_libraries(zerodrift_${name} PRIVATE $<BUILD_INTERFACE:zerodrift_warnings>)
  else()
    add_library(zerodrift_${name} INTERFACE)
    set(scope INTERFACE)
  endif()
  target_sources(zerodrift_${name} ${scope} FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR} FILES ${ARG_HEADERS})
  target_link_libraries(zerodrift_${name} ${scope} zerodrift_options ${ARG_DEPENDS})
  add_library(zerodrift::${name} ALIAS zerodrift_${name})
endfunction()

# Limits of time only end what hangs. Under a sanitizer what computes takes up to forty times as long.
# tests/run.sh has three places a core: what computes takes all of them, what waits for processes, messages and time two. So two
# that compute run at a time, or one beside one that waits, or three that wait. Under a sanitizer everything computes, one a place.
set(zerodrift_times_as_slow 1)
set(zerodrift_computes PROCESSORS 3)
set(zerodrift_waits PROCESSORS 2)
if(ZERODRIFT_FUZZ OR CMAKE_CXX_FLAGS MATCHES "-fsanitize=")
  set(zerodrift_times_as_slow 5)
  set(zerodrift_computes PROCESSORS 1)
  set(zerodrift_waits PROCESSORS 1)
endif()

# zerodrift_test(<name> LABEL unit|golden|system|architecture SOURCES ... DEPENDS ... [TIMEOUT s])
function(zerodrift_test name)
  cmake_parse_arguments(ARG "" "LABEL;TIMEOUT" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_DEPENDS} zerodrift_paths zerodrift_warnings GTest::gtest_main)
  set(places ${zerodrift_computes})
  if("${ARG_DEPENDS}" MATCHES "zerodrift::(dds|service|replay)|zerodrift_console")
    target_link_libraries(${name} PRIVATE zerodrift_compiled_quickly)
    set(places ${zerodrift_waits})
  endif()
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)  # ends what hangs; a loaded machine is slow
  endif()
  math(EXPR limit_s "${ARG_TIMEOUT} * ${zerodrift_times_as_slow}")
  gtest_discover_tests(${name} DISCOVERY_TIMEOUT 120 PROPERTIES LABELS ${ARG_LABEL} TIMEOUT ${limit_s} ${places})
endfunction()

# zerodrift_service(<name> SOURCES ... DEPENDS ...)
function(zerodrift_service name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_DEPENDS} zerodrift::version zerodrift_warnings)
  # Installed among others' programs it says whose it is. install(TARGETS) knows no other name, install(PROGRAMS) doesn't strip.
  string(REPLACE _ - installed zerodrift-${name})
  if(name STREQUAL zerodrift)
    set(installed zerodrift)
  endif()
  install(PROGRAMS $<TARGET_FILE:${name}> DESTINATION bin RENAME ${installed})
  install(CODE "if(CMAKE_INSTALL_DO_STRIP)
  execute_process(COMMAND ${CMAKE_STRIP} \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/bin/${installed}\" COMMAND_ERROR_IS_FATAL ANY)
endif()")
endfunction()
