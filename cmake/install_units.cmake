# SPDX-License-Identifier: Apache-2.0
# Runs at installation. The units name programs and configuration below /usr; another prefix is put in its place.
# `units` is the folder that they come from.
set(goal $ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}/lib/systemd/system)
file(GLOB_RECURSE names RELATIVE ${units} ${units}/*.service ${units}/*.target ${units}/*.service.d/*.conf)
foreach(name IN LISTS names)
  file(READ ${units}/${name} text)
  string(REPLACE "=/usr/" "=${CMAKE_INSTALL_PREFIX}/" text "${text}")
  file(WRITE "${goal}/${name}" "${text}")
  list(APPEND CMAKE_INSTALL_MANIFEST_FILES ${CMAKE_INSTALL_PREFIX}/lib/systemd/system/${name})
endforeach()
