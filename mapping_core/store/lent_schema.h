// A store whose first page is damaged, and with it all that says where its tables begin. Inside this folder and for
// whoever saves stores.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include "mapping_core/store/store_survey.h"

namespace comap {

/// What surveyStore() finds in `copy` once its first page is that of a new store: tables are made in one order, and in
/// one when SQLite writes a store anew, so that they begin where they do in each. Of the layouts that there are, that
/// is taken under which most rows are whole; their checksums are what says so. `copy` is written over, and read
/// as it is then by saveWhole(). Nothing if no keyframe is whole, or its first page can be read and is that of another
/// version.
std::optional<StoreSurvey> surveyWithLentSchema(const std::string& copy,
                                                const std::function<void(size_t, size_t)>& progress = {});

}  // namespace comap
