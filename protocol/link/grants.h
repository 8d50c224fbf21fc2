// What each key may do, as the documents that DDS Security reads. `fleet keys` signs them.
#pragma once

#include <ctime>
#include <string>

#include "protocol/keys/participant.h"

namespace comap {

/// Everything on comap's topics is encrypted, discovery included, and what several may read is bound to who sent it;
/// nobody without a key joins.
std::string governanceText();

/// The participant may write and read the topics of its role in its site, a robot only in its own partition, a tool
/// tiles and interests only there, and nothing else; between `from` and `until` (seconds since 1970). Short, as it must
/// fit the handshake.
std::string permissionsText(const Participant& participant, std::time_t from, std::time_t until);

}  // namespace comap
