// A site's keys on disk: the authority in DIR/authority, one folder for each participant beside it.
#pragma once

#include <string>
#include <vector>

#include "protocol/keys/authority.h"
#include "protocol/keys/credentials.h"

namespace comap {

/// All functions: kWrongUse for names that are none or taken, kUnreachable if a file cannot be read or written,
/// kBadData for files that are not as they were made. Nothing that is there is overwritten, but the list of revoked
/// certificates. Private keys get mode 0600, folders 0700.

/// Makes DIR (new or empty) with an authority for `site`.
Result<void> makeKeysFolder(const std::string& dir, const std::string& site, Validity validity);

/// Makes DIR/NAME: all that this participant needs on its machine, and nothing else.
Result<void> addParticipant(const std::string& dir, KeyRole role, const std::string& name, Validity validity);

/// The certificate of NAME counts no longer: the list says so in every folder of DIR, and DIR/NAME moves to
/// DIR/revoked/NAME-SERIAL, so that the name can be given again. Returns the folders whose machines need the new list.
Result<std::vector<std::string>> revokeParticipant(const std::string& dir, const std::string& name);

/// The names of the participants in DIR, sorted; those in DIR/revoked as "revoked/NAME-SERIAL".
Result<std::vector<std::string>> participantsIn(const std::string& dir);

/// The site of DIR's authority.
Result<std::string> siteOfKeys(const std::string& dir);

}  // namespace comap
