#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Runs an interpreter with its arguments; without numpy it says so and ends with 77, which CTest shows as skipped.
"$1" -c 'import numpy' 2>/dev/null || { echo "$1 has no numpy (apt install python3-numpy): skipped"; exit 77; }
exec "$@"
