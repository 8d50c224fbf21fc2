// What a program prints arrives, or the program fails.
#pragma once

namespace comap {

/// From now on: if what was printed could not be written (a full disk), says so as `program` at the end and ends with
/// 3, whatever the exit code would have been. A reader who has closed a pipe has read enough: that is no failure.
void failOnLostOutput(const char* program);

}  // namespace comap
