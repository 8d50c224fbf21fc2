// Takes a picture of a page in Chromium: take_picture URL FILE WIDTH HEIGHT READY [SCRIPT]
// READY: a JavaScript expression that is waited for. SCRIPT: run then; READY is waited for once more.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <thread>

#include "tests/end_to_end/browser.h"

int main(int argc, char** argv) {
  if (argc < 6) {
    std::fprintf(stderr, "usage: take_picture URL FILE WIDTH HEIGHT READY [SCRIPT]\n");
    return 2;
  }
  const std::string program = comap::findBrowser();
  if (program.empty()) {
    std::fprintf(stderr, "take_picture: no Chromium here; scripts/setup --browser installs one\n");
    return 3;
  }
  try {
    comap::Browser browser(program, std::atoi(argv[3]), std::atoi(argv[4]));
    browser.open(argv[1]);
    bool ready = browser.waitFor(argv[5], 60);
    if (ready && argc > 6) {
      browser.evaluate(argv[6]);
      ready = browser.waitFor(argv[5], 60);
    }
    std::this_thread::sleep_for(std::chrono::seconds(2));  // pictures within the page, the last frame
    browser.screenshot(argv[2]);
    for (const std::string& complaint : browser.complaints()) std::fprintf(stderr, "%s\n", complaint.c_str());
    if (!ready) std::fprintf(stderr, "take_picture: %s did not come true\n", argv[5]);
    return ready && browser.complaints().empty() ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "take_picture: %s\n", error.what());
    return 3;
  }
}
