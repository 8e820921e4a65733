// SPDX-License-Identifier: Apache-2.0
// Included first by what uses messages in ThreadSanitizer's build: Protobuf's map fields have two
// members more there, of which the distribution's library, built without it, knows nothing. Every
// map that it filled was read at the wrong place (SIGSEGV while a model was read).
#pragma once

#pragma push_macro("__SANITIZE_THREAD__")
#undef __SANITIZE_THREAD__
#include <google/protobuf/map_field.h>
#pragma pop_macro("__SANITIZE_THREAD__")
