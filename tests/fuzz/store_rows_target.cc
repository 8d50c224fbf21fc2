// A map store whose rows hold anything: read as tools and a core read it, surveyed, and saved.
#include "mapping_core/store/store_survey.h"
#include "tests/fuzz/change_rows.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/sample_files.h"

using namespace comap;

COMAP_FUZZ_TARGET(bytes) {
  static const fuzz::MemoryFolder folder;
  static const std::string whole = fuzz::writeSampleStore(folder / "whole.comap");
  const std::string path = folder / "changed.comap", saved = folder / "saved.comap";
  for (const std::string& file : {path, saved})
    for (const char* part : {"", "-wal", "-shm"}) std::filesystem::remove(file + part);
  std::filesystem::copy_file(whole, path);
  FuzzedDataProvider provider(bytes.data(), bytes.size());
  fuzz::changeRows(path, provider);
  if (const auto store = MapStore::open(path, MapStore::Mode::kReadOnly)) {
    if (const auto keyframes = store->keyframes())
      for (const StoredKeyframe& keyframe : *keyframes) (void)bool(store->encodedKeyframe(keyframe.id));
    (void)bool(store->edges());
    (void)bool(store->withdrawnEdges());
    (void)bool(store->verdicts());
    (void)bool(store->verdictCounts());
    (void)bool(store->merges());
    (void)bool(store->tiles(""));
    (void)bool(store->mapSizes());
    (void)bool(store->robots());
    (void)bool(store->meta("complete"));
  }
  const bool pages = provider.ConsumeBool();
  const auto survey = surveyStore(path, {}, pages ? SurveyDepth::kPages : SurveyDepth::kRows);
  if (!survey) return;
  if (const auto done = saveWhole(*survey, saved, provider.ConsumeBool() && copyUnseen(path, saved)); !done) {
    std::fprintf(stderr, "%s\n", done.error().text.c_str());
    fuzz::require(false, "what is whole can be saved");
  }
  if (std::getenv("COMAP_FUZZ_TELL") != nullptr)
    for (const std::string& text : survey->damage) std::fprintf(stderr, "damage: %s\n", text.c_str());
  const auto to = MapStore::open(saved, MapStore::Mode::kReadOnly);
  fuzz::require(bool(to), "the new store can be opened");
  fuzz::require(to->keyframes() && to->keyframes()->size() == survey->keyframes.size(),
                "all whole keyframes are saved");
}
