// The agent in the terms of its operators: numbers for Prometheus, one line for people.
#pragma once

#include <string>

#include "edge_agent/agent.h"
#include "protocol/telemetry/telemetry.h"

namespace comap {

constexpr char kAgentMetrics[] = "comap_agent";  ///< what the names of all its metrics begin with

/// ok, poor or lost.
const char* trackingName(TrackingState state);

/// The camera's part of the report; a recording has none.
void addCamera(const CaptureHealth& camera, const MetricsPage::Labels& robot, MetricsPage& page);

/// What a camera does that gives no frames: "camera: depth gone". Empty if all is well, and for recordings.
std::string cameraTrouble(const std::optional<CaptureHealth>& camera);

/// Ready: frames come and their motion is known. Whether a core is there does not matter: the outbox waits for it.
Telemetry::Report reportOf(const Agent& agent, const std::string& robot);

}  // namespace comap
