// What verbs share that change a store at rest: open it alone, restore its maps, change them, write them back.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "mapping_core/service/map_builder.h"

namespace comap {

struct StoreChange {
  std::string store, device = "auto", config;
  bool json = false;
};

/// The options that all such verbs have.
void addStoreChangeOptions(CLI::App& verb, StoreChange& change);

/// Opens the store, which no running core may hold, and calls `before` (may be empty) on it; restores the maps, calls
/// `change` on them, computes poses and surfels anew and writes them with their tiles. Returns {"maps": [{"id",
/// "robots", "keyframes", "hash"}]}; what `before` or `change` refuses is not written.
Result<nlohmann::json> changeStore(const StoreChange& options, const std::function<Result<void>(MapStore&)>& before,
                                   const std::function<Result<void>(MapBuilder&)>& change);

/// Prints what changeStore() told, for people.
void printMaps(const nlohmann::json& outcome);

}  // namespace comap
