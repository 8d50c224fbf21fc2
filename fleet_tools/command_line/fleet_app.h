// The command line of `fleet` as a whole, for running it and for describing it.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>

namespace comap {

/// With all verbs. `exit_code` must outlive it; see verb.h.
std::unique_ptr<CLI::App> makeFleetApp(int& exit_code);

}  // namespace comap
