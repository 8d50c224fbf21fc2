// A real web browser without a screen (Chromium), driven over its debugging pipe: pages, clicks, scripts, pictures.
#pragma once

#include <sys/types.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/files/temporary_folder.h"

namespace comap {

/// COMAP_BROWSER_PROGRAM, or the first of chromium, chromium-browser, google-chrome in PATH; empty if there is none.
std::string findBrowser();

/// Throws std::runtime_error if the browser ends or does not answer in time.
class Browser {
 public:
  Browser(const std::string& program, int width, int height);
  ~Browser();
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  void open(const std::string& url);
  /// The value of a JavaScript expression; promises are waited for.
  nlohmann::json evaluate(const std::string& expression);
  /// Whether the expression became true within `seconds`.
  bool waitFor(const std::string& expression, int seconds);
  void click(double x, double y);
  /// A finger that is put down and lifted.
  void tap(double x, double y);
  /// Two fingers, of which the second moves by 80 pixels and is lifted first.
  void pinch(double x, double y, double other_x, double other_y);
  /// PNG, or JPEG if the name ends with .jpg.
  void screenshot(const std::string& file);
  /// Errors and warnings that pages have logged, exceptions, and what could not be loaded.
  std::vector<std::string> complaints();

 private:
  nlohmann::json command(const std::string& method, const nlohmann::json& parameters = nlohmann::json::object());
  nlohmann::json receive(int seconds);

  const TemporaryFolder profile_;
  pid_t pid_ = -1;
  int to_ = -1, from_ = -1;
  int commands_ = 0;
  std::string session_, buffer_;
  std::vector<nlohmann::json> events_;
};

}  // namespace comap
