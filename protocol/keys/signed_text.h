// Governance and permissions as the DDS Security plug-ins read them: S/MIME, signed by the site's authority.
#pragma once

#include <string>
#include <string_view>

#include "protocol/types/result.h"

namespace comap {

/// `document` with its signature. PEM of the signer's certificate and key; kBadData if they do not fit.
Result<std::string> signText(std::string_view document, const std::string& certificate_pem, const std::string& key_pem);

/// What was signed, if a certificate that may sign and that `authority_pem` has signed (or is) has signed it; else
/// kBadData. Errors name `path`.
Result<std::string> verifySignedText(std::string_view signed_text, const std::string& authority_pem,
                                     const std::string& path);

}  // namespace comap
