// The numbers of one moment, as Prometheus reads them.
#pragma once

#include <prometheus/metric_family.h>

#include <map>
#include <string>
#include <vector>

#include "protocol/telemetry/time_histogram.h"

namespace comap {

/// Made anew for each moment: values in, text out. Names are snake_case and end in their unit (seconds, bytes);
/// counters end in _total. Samples of one name stand together, in whatever order they were added.
/// Thread rule: one thread.
class MetricsPage {
 public:
  using Labels = std::map<std::string, std::string>;

  /// What never becomes less while the program runs.
  void counter(const std::string& name, const std::string& help, double value, const Labels& labels = {});
  /// What goes up and down.
  void gauge(const std::string& name, const std::string& help, double value, const Labels& labels = {});
  /// Durations, told in seconds: number, sum, median, 95 % and largest, all since the program's start.
  void summary(const std::string& name, const std::string& help, const TimeHistogram& times, const Labels& labels = {});
  /// Memory, processor time and start of this process, under the names that Prometheus' own clients use.
  void process();

  /// Prometheus' text format, version 0.0.4.
  std::string text() const;

  const std::vector<prometheus::MetricFamily>& families() const { return families_; }

 private:
  prometheus::ClientMetric& sample(const std::string& name, const std::string& help, prometheus::MetricType type,
                                   const Labels& labels);
  std::vector<prometheus::MetricFamily> families_;
};

}  // namespace comap
