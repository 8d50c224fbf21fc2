// What each key may do, as the documents that DDS Security reads. `fleet keys` signs them.
#pragma once

#include <ctime>
#include <string>

#include "protocol/keys/participant.h"

namespace comap {

/// Everything on comap's topics is encrypted and bound to who sent it, discovery included; nobody without a key joins.
std::string governanceText();

/// The participant may write and read the topics of its role in its site, and nothing else; between `from` and `until`
/// (seconds since 1970). Short, as it must fit the handshake.
std::string permissionsText(const Participant& participant, std::time_t from, std::time_t until);

}  // namespace comap
