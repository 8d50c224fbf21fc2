#include "tests/benchmarks/odometry/clocks.h"

#include <sched.h>
#include <time.h>

#include <cstdlib>

namespace comap {
namespace {

double read_ms(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

}  // namespace

double threadCpu_ms() { return read_ms(CLOCK_THREAD_CPUTIME_ID); }

double processCpu_ms() { return read_ms(CLOCK_PROCESS_CPUTIME_ID); }

double wall_ms() { return read_ms(CLOCK_MONOTONIC); }

bool stayOnOneCore() {
  const int core = sched_getcpu();
  if (core < 0) return false;
  cpu_set_t cores;
  CPU_ZERO(&cores);
  CPU_SET(static_cast<size_t>(core), &cores);
  return sched_setaffinity(0, sizeof cores, &cores) == 0;
}

double machineLoad() {
  double load = 0;
  return getloadavg(&load, 1) == 1 ? load : -1;
}

}  // namespace comap
