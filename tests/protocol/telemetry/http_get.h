// A plain HTTP request over loopback, so that tests see a server as curl does.
#pragma once

#include <string>

namespace comap {

struct HttpAnswer {
  int status = 0;  ///< 0: no answer
  std::string head, body;
};

/// Sends `request` as it is and reads until the server closes, 5 s at most.
HttpAnswer httpSend(int port, const std::string& request);
HttpAnswer httpGet(int port, const std::string& path);

/// A port of loopback that nobody listens on.
int freePort();

}  // namespace comap
