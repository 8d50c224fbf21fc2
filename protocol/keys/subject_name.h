// Subject names in OpenSSL's form. Inside this folder only.
#pragma once

#include "protocol/keys/openssl_handles.h"
#include "protocol/keys/participant.h"

namespace comap {

/// O, OU, CN as UTF8String: the same bytes wherever it is made.
NameHandle subjectName(const Participant& participant);

/// The participant that a subject of that form is for; kBadData naming `path` for any other.
Result<Participant> participantOf(const X509_NAME* subject, const std::string& path);

}  // namespace comap
