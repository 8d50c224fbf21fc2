// A folder of keys with one file changed: the first byte says which; whole if the second is even, else triples of
// place (two bytes) and byte.
#include <sys/stat.h>

#include <ctime>

#include "fleet_tools/keys/keys_folder.h"
#include "protocol/keys/signed_text.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/sample_files.h"

using namespace comap;

namespace {

std::string makeKeys(const std::string& keys) {
  const std::time_t now = std::time(nullptr);
  const Validity validity{now - 60, now + 86400};
  fuzz::require(makeKeysFolder(keys, "flat", validity) && addParticipant(keys, KeyRole::kRobot, "a", validity) &&
                    checkCredentials(credentialsIn(keys + "/a"), now),
                "keys can be made");
  return keys + "/a";
}

}  // namespace

COMAP_FUZZ_TARGET(bytes) {
  static const fuzz::MemoryFolder folder;
  static const std::string own = makeKeys(folder / "keys");
  if (bytes.size() < 2) return;
  const Credentials credentials = credentialsIn(own);
  const std::string paths[] = {credentials.authority,  credentials.certificate, credentials.key,
                               credentials.governance, credentials.permissions, credentials.revoked};
  const std::string& path = paths[bytes[0] % 6];
  const std::string whole = fuzz::readFile(path);
  std::string changed;
  if (bytes[1] % 2 == 0) {
    changed = fuzz::textOf(bytes.subspan(2));
  } else {
    changed = whole;
    for (auto edits = bytes.subspan(2); edits.size() >= 3; edits = edits.subspan(3))
      changed[(edits[0] * size_t{256} + edits[1]) % changed.size()] = static_cast<char>(edits[2]);
  }
  std::ofstream(path, std::ios::binary) << changed;
  const std::time_t now = std::time(nullptr);
  (void)bool(factsOf(credentials, now));
  (void)announcedAuthority(credentials);
  (void)bool(checkCredentials(credentials, now));
  std::ofstream(path, std::ios::binary) << whole;
  (void)bool(verifySignedText(changed, fuzz::readFile(credentials.authority), "changed"));
}
