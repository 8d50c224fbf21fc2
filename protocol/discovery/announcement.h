// What is read of a DDS participant's own announcement.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

namespace comap {

using ParticipantPrefix = std::array<uint8_t, 12>;  ///< the start of the GUIDs of all that a participant has

/// Whose RTPS message this is; nothing if it is none.
std::optional<ParticipantPrefix> senderOf(std::span<const uint8_t> message);

/// Whether this is a participant's announcement of itself and nothing else: all that a discovery server passes on, and
/// all that is handed to DDS in another's name.
bool isAnnouncement(std::span<const uint8_t> message);

/// The port on which the participant that `message` announces listens for announcements of others; nothing if it does
/// not say.
std::optional<uint16_t> announcedPort(std::span<const uint8_t> message);

}  // namespace comap
