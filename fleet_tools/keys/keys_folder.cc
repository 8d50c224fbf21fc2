#include "fleet_tools/keys/keys_folder.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "protocol/link/grants.h"
#include "protocol/types/whole_file.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

constexpr mode_t kForAll = 0644, kForOwner = 0600;

Error cannot(const std::string& path, const char* what) {
  return {ErrorCode::kUnreachable, path + ": " + what + ": " + std::strerror(errno)};
}

// Never over what is there; a private key is never readable for others, not even for a moment.
Result<void> writeNew(const std::string& path, const std::string& content, mode_t mode) {
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  if (file < 0) return cannot(path, "cannot be made");
  const bool written =
      write(file, content.data(), content.size()) == static_cast<ssize_t>(content.size()) && fsync(file) == 0;
  if (close(file) != 0 || !written) return cannot(path, "cannot be written");
  return {};
}

Result<void> makeFolder(const std::string& path) {
  if (mkdir(path.c_str(), 0700) != 0) return cannot(path, "cannot be made");
  return {};
}

Result<std::string> readFile(const std::string& path) {
  if (auto regular = checkRegular(path); !regular) return regular.error();
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file || file.bad()) return cannot(path, "cannot be read");
  return text.str();
}

std::string authorityFolder(const std::string& dir) { return dir + "/authority"; }
// A copy of each certificate stays with the authority, so that a key can be revoked whose folder is gone.
std::string issuedFolder(const std::string& dir) { return authorityFolder(dir) + "/issued"; }

// "a-1F2E.pem" is one of 'a', "a-b-1F2E.pem" is not.
bool isCopyOf(const std::string& name, const std::string& file) {
  return file.starts_with(name + "-") && file.find('-', name.size() + 1) == std::string::npos;
}

bool isThere(const std::string& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

Result<Authority> openAuthority(const std::string& dir) {
  const std::string folder = authorityFolder(dir);
  if (!isThere(folder + "/key.pem"))
    return Error{ErrorCode::kUnreachable,
                 dir + ": holds no authority ('" + folder + "/key.pem' is not there): make one with 'fleet keys init'"};
  const auto certificate = readFile(folder + "/authority.pem");
  if (!certificate) return certificate.error();
  const auto key = readFile(folder + "/key.pem");
  if (!key) return key.error();
  auto authority = Authority::fromPem(*certificate, *key);
  if (!authority) return Error{authority.error().code, folder + ": " + authority.error().text};
  return authority;
}

// The certificates of NAME that are not revoked yet, by serial; that of its folder first. Of the copies that stay with
// the authority as well: the folder may be gone.
Result<std::vector<std::pair<std::string, std::string>>> certificatesOf(const std::string& dir,
                                                                        const std::string& name) {
  std::vector<std::pair<std::string, std::string>> found;
  const auto add = [&](const std::string& path) -> Result<void> {
    Credentials files = credentialsIn(authorityFolder(dir));
    files.certificate = path;
    const auto facts = factsOf(files, std::time(nullptr));
    if (!facts) return facts.error();
    const auto pem = readFile(path);
    if (!pem) return pem.error();
    const bool known = facts->revoked || std::any_of(found.begin(), found.end(),
                                                     [&](const auto& each) { return each.first == facts->serial; });
    if (!known && facts->participant.name == name) found.emplace_back(facts->serial, *pem);
    return {};
  };
  const std::string own = credentialsIn(dir + "/" + name).certificate;
  if (isThere(own))
    if (auto added = add(own); !added) return added.error();
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(issuedFolder(dir), none))
    if (isCopyOf(name, entry.path().filename().string()))
      if (auto added = add(entry.path().string()); !added) return added.error();
  return found;
}

// "authority" and "revoked" are folders of their own.
std::string participantNameProblem(const std::string& name) {
  if (name == "authority" || name == "revoked") return "the name '" + name + "' is taken by a folder of the keys";
  return keyNameProblem(name);
}

}  // namespace

Result<void> makeKeysFolder(const std::string& dir, const std::string& site, Validity validity) {
  const auto authority = Authority::create(site, validity);
  if (!authority) return authority.error();
  const auto revoked = authority->emptyRevocations();
  if (!revoked) return revoked.error();
  std::error_code error;
  if (fs::exists(dir, error) && !(fs::is_directory(dir, error) && fs::is_empty(dir, error)))
    return Error{ErrorCode::kWrongUse,
                 dir + ": is there and not empty; keys are never overwritten: choose a new folder"};
  if (!fs::exists(dir, error))
    if (auto made = makeFolder(dir); !made) return made;
  const std::string folder = authorityFolder(dir);
  if (auto made = makeFolder(folder); !made) return made;
  if (auto written = writeNew(folder + "/key.pem", authority->keyPem(), kForOwner); !written) return written;
  if (auto written = writeNew(folder + "/authority.pem", authority->certificatePem(), kForAll); !written)
    return written;
  return writeNew(folder + "/revoked.pem", *revoked, kForAll);
}

Result<void> addParticipant(const std::string& dir, KeyRole role, const std::string& name, Validity validity) {
  if (const std::string problem = participantNameProblem(name); !problem.empty())
    return Error{ErrorCode::kWrongUse, problem};
  const auto authority = openAuthority(dir);
  if (!authority) return authority.error();
  const std::string folder = dir + "/" + name;
  if (isThere(folder))
    return Error{ErrorCode::kWrongUse,
                 folder +
                     ": there are keys of that name already, and keys are never overwritten: choose another name, "
                     "or revoke it first with 'fleet keys revoke'"};
  const Participant participant{authority->site(), role, name};
  const auto issued = authority->issue(participant, validity);
  if (!issued) return issued.error();
  const auto governance = authority->sign(governanceText());
  if (!governance) return governance.error();
  const auto permissions = authority->sign(permissionsText(participant, validity.from, validity.until));
  if (!permissions) return permissions.error();
  const auto revoked = readFile(authorityFolder(dir) + "/revoked.pem");
  if (!revoked) return revoked.error();

  // Under another name until it is whole.
  const std::string draft = dir + "/." + name + ".new";
  std::error_code ignored;
  fs::remove_all(draft, ignored);
  if (auto made = makeFolder(draft); !made) return made;
  const Credentials files = credentialsIn(draft);
  if (auto written = writeNew(files.key, issued->key, kForOwner); !written) return written;
  for (const auto& [path, content] :
       {std::pair(files.authority, authority->certificatePem()), std::pair(files.certificate, issued->certificate),
        std::pair(files.governance, *governance), std::pair(files.permissions, *permissions),
        std::pair(files.revoked, *revoked)})
    if (auto written = writeNew(path, content, kForAll); !written) return written;
  const auto facts = factsOf(files, std::time(nullptr));
  if (!facts) return facts.error();
  if (!isThere(issuedFolder(dir)))
    if (auto made = makeFolder(issuedFolder(dir)); !made) return made;
  const std::string copy = issuedFolder(dir) + "/" + name + "-" + facts->serial + ".pem";
  if (auto written = writeNew(copy, issued->certificate, kForAll); !written) return written;
  if (rename(draft.c_str(), folder.c_str()) != 0) return cannot(folder, "cannot be made");
  return {};
}

Result<std::vector<std::string>> revokeParticipant(const std::string& dir, const std::string& name) {
  if (const std::string problem = participantNameProblem(name); !problem.empty())
    return Error{ErrorCode::kWrongUse, problem};
  const auto authority = openAuthority(dir);
  if (!authority) return authority.error();
  const std::string folder = dir + "/" + name;
  const auto certificates = certificatesOf(dir, name);
  if (!certificates) return certificates.error();
  if (certificates->empty() && isThere(credentialsIn(folder).certificate))
    return Error{ErrorCode::kWrongUse,
                 folder + ": its certificate is revoked already, or of another name; move the folder away"};
  if (certificates->empty() && isThere(folder))
    return Error{ErrorCode::kUnreachable, folder + ": its certificate.pem is gone, and " + issuedFolder(dir) +
                                              " has no copy of it: without its serial number it cannot be revoked; "
                                              "make a new authority and all keys anew"};
  if (certificates->empty())
    return Error{ErrorCode::kWrongUse, dir + ": there are no keys of '" + name + "' ('fleet keys show' lists them)"};
  const std::string list = authorityFolder(dir) + "/revoked.pem";
  const auto before = readFile(list);
  if (!before) return before.error();
  Result<std::string> after = *before;
  for (const auto& [serial, certificate] : *certificates) {
    after = authority->revoke(*after, certificate);
    if (!after) return after.error();
  }
  if (auto written = writeWholeFile(list, *after); !written) return written.error();
  auto names = participantsIn(dir);
  if (!names) return names.error();
  std::vector<std::string> others;
  for (const std::string& each : *names) {
    if (auto written = writeWholeFile(credentialsIn(dir + "/" + each).revoked, *after); !written)
      return written.error();
    if (each != name && !each.starts_with("revoked/")) others.push_back(dir + "/" + each);
  }
  if (!isThere(folder)) return others;
  if (!isThere(dir + "/revoked"))
    if (auto made = makeFolder(dir + "/revoked"); !made) return made.error();
  std::error_code error;
  fs::rename(folder, dir + "/revoked/" + name + "-" + certificates->front().first, error);
  if (error) return Error{ErrorCode::kUnreachable, folder + ": is revoked, but cannot be moved: " + error.message()};
  return others;
}

Result<std::vector<std::string>> participantsIn(const std::string& dir) {
  std::vector<std::string> names;
  for (const std::string& below : {std::string(), std::string("revoked/")}) {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(dir + "/" + below, error)) {
      const std::string name = entry.path().filename().string();
      const bool has_keys = isThere(entry.path() / "certificate.pem") || isThere(entry.path() / "key.pem");
      if (name.starts_with(".") || name == "authority" || !has_keys) continue;
      names.push_back(below + name);
    }
    if (error && below.empty()) return Error{ErrorCode::kUnreachable, dir + ": cannot be read: " + error.message()};
  }
  std::sort(names.begin(), names.end());
  return names;
}

Result<std::string> siteOfKeys(const std::string& dir) {
  const auto authority = openAuthority(dir);
  if (!authority) return authority.error();
  return authority->site();
}

}  // namespace comap
