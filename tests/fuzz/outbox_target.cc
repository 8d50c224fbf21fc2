// An outbox whose rows hold anything: read as an agent reads it, then rescued.
#include "edge_agent/uplink/outbox.h"
#include "tests/fuzz/change_rows.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/sample_files.h"

using namespace comap;

COMAP_FUZZ_TARGET(bytes) {
  static const fuzz::MemoryFolder folder;
  static const std::string whole = fuzz::writeSampleOutbox(folder / "whole.outbox");
  for (const auto& entry : std::filesystem::directory_iterator(folder / ""))
    if (entry.path() != whole) std::filesystem::remove(entry.path());
  const std::string path = folder / "a.outbox";
  std::filesystem::copy_file(whole, path);
  FuzzedDataProvider provider(bytes.data(), bytes.size());
  fuzz::changeRows(path, provider);
  if (auto outbox = Outbox::open(path)) {
    for (const uint64_t session : outbox->sessions()) {
      if (const auto rows = outbox->rows(session, 0, 100)) {
        for (const OutboxRow& row : *rows) {
          (void)bool(outbox->encoded(row.key));
          (void)bool(outbox->linkedTo(row.key));
          (void)bool(outbox->markSent(row.key));
        }
      }
      (void)bool(outbox->last(session));
      (void)bool(outbox->firstFrom(session, 1));
    }
    (void)bool(outbox->oldestUnthinned());
    (void)bool(outbox->belongTo("r"));
    (void)bool(outbox->beginSession(1));
    (void)outbox->bytes();
    Acknowledgement ack;
    ack.session = fuzz::kSampleSession;
    ack.next_expected = 1;
    ack.also_held = {2};
    (void)bool(outbox->acknowledge(ack));
    (void)bool(outbox->firstFrom(fuzz::kSampleSession, 0));
    (void)bool(outbox->takeOutDelivered());
  }
  fuzz::require(bool(rescueOutbox(path)), "an outbox that can be moved can be rescued");
}
