// Bad values inside a database whose pages are whole.
#pragma once

#include <fuzzer/FuzzedDataProvider.h>

#include <string>

namespace comap::fuzz {

/// Changes values of the database's rows, takes rows out, and (if the bytes say so) makes checksums fit again.
void changeRows(const std::string& path, FuzzedDataProvider& bytes);

}  // namespace comap::fuzz
