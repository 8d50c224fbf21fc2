// A file that may be no map store at all, or one with bad pages: four bytes say where, and with what it is overwritten.
#include "mapping_core/store/store_survey.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/sample_files.h"

using namespace comap;

COMAP_FUZZ_TARGET(bytes) {
  static const fuzz::MemoryFolder folder;
  static const std::string whole = fuzz::readFile(fuzz::writeSampleStore(folder / "whole.comap"));
  std::string changed = whole;
  for (; bytes.size() >= 4; bytes = bytes.subspan(4)) {
    const size_t at = (size_t{bytes[0]} << 16 | size_t{bytes[1]} << 8 | bytes[2]) % changed.size();
    changed[at] = static_cast<char>(bytes[3]);
  }
  if (bytes.size() == 1) changed.resize(changed.size() * bytes[0] / 256);  // cut off
  const std::string path = folder.write("changed.comap", fuzz::bytesOf(changed)), saved = folder / "saved.comap";
  for (const SurveyDepth depth : {SurveyDepth::kRows, SurveyDepth::kPages}) {
    for (const char* part : {"", "-wal", "-shm"}) std::filesystem::remove(saved + part);
    const auto survey = surveyStore(path, {}, depth);
    if (!survey) continue;
    if (!saveWhole(*survey, saved, depth == SurveyDepth::kRows && copyUnseen(path, saved))) continue;
    const auto again = surveyStore(saved);
    fuzz::require(again && again->damage.empty(), "what is saved is whole");
  }
}
