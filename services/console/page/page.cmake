# SPDX-License-Identifier: Apache-2.0
# The console's page: sources and idl/proto/telemetry.proto are copied into the build folder, installed and bundled there
# (npm ci, npm run build), and put into ${CMAKE_BINARY_DIR}/share/zerodrift/console, with the documents in docs/. Target: console_page.
# The folder as it is in the checkout is never written to. Included where ZERODRIFT_BUILD_PAGE is on.
set(ZERODRIFT_CONSOLE_PAGE_DIR ${CMAKE_BINARY_DIR}/share/zerodrift/console)

include(${PROJECT_SOURCE_DIR}/cmake/Npm.cmake)
find_program(ZERODRIFT_PROTOC protoc REQUIRED)
find_program(ZERODRIFT_NODE NAMES node nodejs REQUIRED)

set(page_dir ${CMAKE_CURRENT_LIST_DIR})
set(page_work ${CMAKE_BINARY_DIR}/console_page)
set(page_proto ${PROJECT_SOURCE_DIR}/idl/proto/telemetry.proto)
set(page_packages ${page_dir}/package.json ${page_dir}/package-lock.json ${page_dir}/.npmrc)
file(GLOB_RECURSE page_sources CONFIGURE_DEPENDS ${page_dir}/src/* ${page_dir}/public/* ${page_dir}/scripts/*)
list(FILTER page_sources EXCLUDE REGEX "/src/generated/")
file(GLOB page_tests CONFIGURE_DEPENDS ${page_dir}/tests/*.ts)
set(page_settings ${page_dir}/index.html ${page_dir}/vite.config.js ${page_dir}/svelte.config.js ${page_dir}/tsconfig.json
                  ${page_dir}/tsconfig.test.json)

zerodrift_npm_ci(${page_work} COMMENT "Console page" PACKAGES ${page_packages})

add_custom_command(
  OUTPUT ${page_work}/page.stamp
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${page_work}/src ${page_work}/public ${page_work}/scripts
          ${page_work}/tests
  COMMAND ${CMAKE_COMMAND} -E copy_directory ${page_dir}/src ${page_work}/src
  COMMAND ${CMAKE_COMMAND} -E copy_directory ${page_dir}/public ${page_work}/public
  COMMAND ${CMAKE_COMMAND} -E copy_directory ${page_dir}/scripts ${page_work}/scripts
  COMMAND ${CMAKE_COMMAND} -E copy_directory ${page_dir}/tests ${page_work}/tests
  COMMAND ${CMAKE_COMMAND} -E copy ${page_settings} ${page_work}
  COMMAND ${CMAKE_COMMAND} -E make_directory ${page_work}/proto
  COMMAND ${CMAKE_COMMAND} -E copy ${page_proto} ${page_work}/proto
  COMMAND ${CMAKE_COMMAND} -E chdir ${page_work} ${CMAKE_COMMAND} -E env
          ZERODRIFT_PROTO_DIR=${page_work}/proto ZERODRIFT_PAGE_OUT=${ZERODRIFT_CONSOLE_PAGE_DIR} PROTOC=${ZERODRIFT_PROTOC}
          ${ZERODRIFT_NPM} run --silent build
  COMMAND ${CMAKE_COMMAND} -E touch ${page_work}/page.stamp
  DEPENDS ${page_work}/packages.stamp ${page_sources} ${page_tests} ${page_settings} ${page_proto}
  COMMENT "Console page: bundling"
  VERBATIM)

# After the page, which begins with an empty folder.
file(GLOB page_documents CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/docs/*.md ${PROJECT_SOURCE_DIR}/docs/pictures/*)
add_custom_command(
  OUTPUT ${page_work}/docs.stamp
  COMMAND ${ZERODRIFT_NODE} ${page_work}/scripts/docs.mjs ${PROJECT_SOURCE_DIR}/docs ${ZERODRIFT_CONSOLE_PAGE_DIR}/docs
  COMMAND ${CMAKE_COMMAND} -E touch ${page_work}/docs.stamp
  DEPENDS ${page_work}/page.stamp ${page_documents} ${PROJECT_SOURCE_DIR}/deploy/OPERATIONS.md
  COMMENT "Console page: documents"
  VERBATIM)

add_custom_target(console_page ALL DEPENDS ${page_work}/docs.stamp)
install(DIRECTORY ${ZERODRIFT_CONSOLE_PAGE_DIR} DESTINATION share/zerodrift)
