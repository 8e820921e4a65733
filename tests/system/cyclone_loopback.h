// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace zerodrift::system_test {

// Loopback, no multicast, and the ports of the participants that our discovery looks for.
inline constexpr const char* kLoopbackOnly =
    "<CycloneDDS><Domain Id=\"any\">"
    "<General><Interfaces><NetworkInterface name=\"lo\" multicast=\"false\"/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>39</MaxAutoParticipantIndex>"
    "<Peers><Peer Address=\"127.0.0.1\"/></Peers></Discovery>"
    "</Domain></CycloneDDS>";

}  // namespace zerodrift::system_test
