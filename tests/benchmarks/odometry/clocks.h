// Time and processor, of the calling thread and of the whole program.
#pragma once

namespace comap {

/// Processor time that this thread has used, milliseconds: other programs do not count, but slow it down somewhat.
double threadCpu_ms();

/// The same of all threads of this program.
double processCpu_ms();

/// Milliseconds of a clock that only goes forward.
double wall_ms();

/// Keeps this thread, and those it starts, on the processor core it is on. False if the system refuses.
bool stayOnOneCore();

/// Programs that want to run, averaged over the last minute; -1 if unknown.
double machineLoad();

}  // namespace comap
