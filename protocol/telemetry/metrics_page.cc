#include "protocol/telemetry/metrics_page.h"

#include <prometheus/check_names.h>
#include <prometheus/text_serializer.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cassert>
#include <ctime>
#include <fstream>

namespace comap {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;

double residentBytes() {
  std::ifstream file("/proc/self/statm");
  double all = 0, resident = 0;
  file >> all >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

double processorSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

}  // namespace

ClientMetric& MetricsPage::sample(const std::string& name, const std::string& help, MetricType type,
                                  const Labels& labels) {
  assert(prometheus::CheckMetricName(name));
  auto family = std::find_if(families_.begin(), families_.end(), [&](const auto& one) { return one.name == name; });
  if (family == families_.end()) {
    MetricFamily created;
    created.name = name;
    created.help = help;
    created.type = type;
    family = families_.insert(families_.end(), std::move(created));
  }
  assert(family->type == type);
  ClientMetric& metric = family->metric.emplace_back();
  for (const auto& [key, value] : labels) metric.label.push_back({key, value});
  return metric;
}

void MetricsPage::counter(const std::string& name, const std::string& help, double value, const Labels& labels) {
  sample(name, help, MetricType::Counter, labels).counter.value = value;
}

void MetricsPage::gauge(const std::string& name, const std::string& help, double value, const Labels& labels) {
  sample(name, help, MetricType::Gauge, labels).gauge.value = value;
}

void MetricsPage::summary(const std::string& name, const std::string& help, const TimeHistogram& times,
                          const Labels& labels) {
  ClientMetric::Summary& summary = sample(name, help, MetricType::Summary, labels).summary;
  summary.sample_count = times.count();
  summary.sample_sum = 1e-3 * times.sum_ms();
  summary.quantile = {
      {0.5, 1e-3 * times.quantile_ms(0.5)}, {0.95, 1e-3 * times.quantile_ms(0.95)}, {1.0, 1e-3 * times.worst_ms()}};
}

void MetricsPage::process() {
  static const auto kStart = static_cast<double>(std::time(nullptr));
  gauge("process_resident_memory_bytes", "Resident memory size in bytes.", residentBytes());
  counter("process_cpu_seconds_total", "Total user and system CPU time spent in seconds.", processorSeconds());
  gauge("process_start_time_seconds", "Start time of the process since unix epoch in seconds.", kStart);
}

std::string MetricsPage::text() const { return prometheus::TextSerializer().Serialize(families_); }

}  // namespace comap
