// SPDX-License-Identifier: Apache-2.0
#pragma once

// For C and C++: loopback, no multicast, and the ports of the participants that our discovery looks
// for.
static const char* const kLoopbackOnly =
    "<CycloneDDS><Domain Id=\"any\">"
    "<General><Interfaces><NetworkInterface name=\"lo\" multicast=\"false\"/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>39</MaxAutoParticipantIndex>"
    "<Peers><Peer Address=\"127.0.0.1\"/></Peers></Discovery>"
    "</Domain></CycloneDDS>";
