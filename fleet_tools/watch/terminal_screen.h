// The whole of a terminal, drawn in place, and left as it was found.
#pragma once

#include <termios.h>

#include <string>
#include <vector>

namespace comap {

/// stdout and, for keys, stdin, if that is a terminal too. The terminal's other screen without a cursor while this
/// lives; keys are not echoed. Thread rule: one thread, one at a time.
class TerminalScreen {
 public:
  TerminalScreen();
  ~TerminalScreen();
  TerminalScreen(const TerminalScreen&) = delete;
  TerminalScreen& operator=(const TerminalScreen&) = delete;

  /// As many lines and columns as there is room for, without flicker.
  void draw(const std::vector<std::string>& lines);
  /// Whether the terminal's size has changed since the last drawing.
  bool resized() const;
  /// Whether 'q' was pressed since the last question.
  bool quitAsked();

 private:
  bool keys_ = false;  // stdin is a terminal whose settings were changed
  termios before_{};
};

/// The first `columns` characters of UTF-8 text.
std::string clipped(const std::string& text, size_t columns);

}  // namespace comap
