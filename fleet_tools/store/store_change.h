// What verbs share that change a store at rest: the decision goes into its records at once; the maps are computed from
// the records, now or later.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "mapping_core/service/core_config.h"
#include "mapping_core/service/map_builder.h"

namespace comap {

struct StoreChange {
  std::string store, device = "auto", config;
  bool json = false, later = false;
};

/// --device, --config and --json.
void addComputeOptions(CLI::App& verb, StoreChange& change);
/// These and --later.
void addStoreChangeOptions(CLI::App& verb, StoreChange& change);

/// The core's configuration that was given, or the default one. kWrongUse, too, if the device's words choose none.
Result<CoreConfig> configOf(const StoreChange& change);

/// Whether the device is there, unless --later leaves it to others: before anything is written, so that the same
/// command can be given again.
Result<void> checkDevice(const StoreChange& change);

/// Opens a store at rest, and says on stderr what is wrong with the end of its log, which is then begun anew. Who opens
/// a store to write writes to its file: what `refusal` says of it before, to kWrongUse, leaves every byte as it is.
Result<MapStore> openToChange(const std::string& path,
                              const std::function<Result<void>(const MapStore&)>& refusal = {});

/// Computes what the store's records say, with progress on a terminal: votes that wait are judged, poses and surfels
/// made anew and written with their tiles. Returns {"maps": [{"id", "robots", "keyframes", "hash"}], "merges": [...]},
/// the merges that waiting votes made. What fails or is interrupted leaves the records as they are, marked incomplete.
Result<nlohmann::json> computeMaps(const StoreChange& change, const CoreConfig& config, MapStore& store);

/// Writes the file anew if a robot was forgotten since, and says so. Returns whether it did.
Result<bool> compactIfDue(const StoreChange& change, MapStore& store);

/// After a decision that is in the records: computes the maps unless --later, adds them to `outcome` and prints that,
/// as JSON or as tables. Returns the exit code.
int followUp(const StoreChange& change, const CoreConfig& config, MapStore& store, nlohmann::json outcome);

/// Prints what computeMaps() told, for people.
void printMaps(const nlohmann::json& outcome);

}  // namespace comap
