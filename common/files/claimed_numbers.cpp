// SPDX-License-Identifier: Apache-2.0
#include "common/files/claimed_numbers.h"

#include <fcntl.h>

#include <cerrno>

namespace zerodrift::files {

ClaimedNumbers::ClaimedNumbers(const std::filesystem::path& folder)
    : file_(folder.empty() ? -1
                           : ::open((folder / ".claims").c_str(),
                                    O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666)) {}

// A lock of an open file description: one of the process would go with any descriptor that is
// closed.
bool ClaimedNumbers::claim(std::uint32_t number, Claim how) {
  if (!file_.is_open()) return true;
  struct flock lock {};
  lock.l_type = how == Claim::kAlone ? F_WRLCK : F_RDLCK;
  lock.l_whence = SEEK_SET;
  lock.l_start = number;
  lock.l_len = 1;
  return ::fcntl(file_.number(), F_OFD_SETLK, &lock) == 0 || (errno != EAGAIN && errno != EACCES);
}

}  // namespace zerodrift::files
