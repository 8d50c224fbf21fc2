// The options by which a verb of `fleet` listens to a running site.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "protocol/link/dds_link.h"

namespace comap {

/// Adds --site, --domain, --interface, --core, --keys and --insecure, which fill `options`.
void addObserverOptions(CLI::App& verb, DdsLinkOptions& options);

/// An observer's link. `asks_for_tiles`: it gets a name, that of its certificate if it has keys.
/// Errors as connectDds().
Result<std::unique_ptr<Link>> connectObserver(DdsLinkOptions options, bool asks_for_tiles, std::string& name);

}  // namespace comap
