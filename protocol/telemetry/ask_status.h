// Asks another program's status page.
#pragma once

#include <chrono>
#include <string>

#include "protocol/types/result.h"

namespace comap {

/// What a running program answers to `path` on its status page; kProblem if that is not status 200, kUnreachable if
/// there is no answer within `patience`: whoever asks is asked for health himself, and has a limit.
Result<std::string> askStatus(const std::string& address, int port, const std::string& path,
                              std::chrono::milliseconds patience = std::chrono::seconds(3));

}  // namespace comap
