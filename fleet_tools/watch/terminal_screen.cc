#include "fleet_tools/watch/terminal_screen.h"

#include <poll.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace comap {
namespace {

// The other screen, without a cursor, and back.
constexpr const char* kEnter = "\x1b[?1049h\x1b[?25l";
constexpr const char* kLeave = "\x1b[?25h\x1b[?1049l";
// From the top; behind each line's text the rest of it is cleared, and what is below the last one.
constexpr const char* kTop = "\x1b[H";
constexpr const char* kClearLine = "\x1b[K";
constexpr const char* kClearBelow = "\x1b[J";

volatile sig_atomic_t g_resized = 0;

struct Size {
  size_t rows = 24, columns = 120;
};

Size sizeOfTerminal() {
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0) return {};
  return {size.ws_row, size.ws_col};
}

void write(const std::string& text) {
  std::fputs(text.c_str(), stdout);
  std::fflush(stdout);
}

}  // namespace

TerminalScreen::TerminalScreen() {
  struct sigaction action {};
  action.sa_handler = [](int) { g_resized = 1; };
  sigaction(SIGWINCH, &action, nullptr);
  if (isatty(STDIN_FILENO) == 1 && tcgetattr(STDIN_FILENO, &before_) == 0) {
    termios keys = before_;
    keys.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);  // Ctrl-C stays what it is
    keys_ = tcsetattr(STDIN_FILENO, TCSANOW, &keys) == 0;
  }
  write(kEnter);
}

TerminalScreen::~TerminalScreen() {
  write(kLeave);
  if (keys_) tcsetattr(STDIN_FILENO, TCSAFLUSH, &before_);
  signal(SIGWINCH, SIG_DFL);
}

void TerminalScreen::draw(const std::vector<std::string>& lines) {
  g_resized = 0;
  const Size size = sizeOfTerminal();
  std::string screen = kTop;
  for (size_t i = 0; i < std::min(lines.size(), size.rows); ++i) {
    if (i > 0) screen += "\r\n";  // none behind the last one: it would scroll
    // One column stays free: behind a full line xterm's cursor is still on its last character, which would be cleared.
    screen += clipped(lines[i], size.columns - 1) + kClearLine;
  }
  write(screen + kClearBelow);
}

bool TerminalScreen::resized() const { return g_resized != 0; }

bool TerminalScreen::quitAsked() {
  bool asked = false;
  pollfd keyboard{STDIN_FILENO, POLLIN, 0};
  while (keys_ && poll(&keyboard, 1, 0) == 1 && (keyboard.revents & POLLIN) != 0) {
    char key = 0;
    if (read(STDIN_FILENO, &key, 1) != 1) break;
    asked = asked || key == 'q' || key == 'Q';
  }
  return asked;
}

std::string clipped(const std::string& text, size_t columns) {
  size_t at = 0;
  for (size_t characters = 0; at < text.size(); ++at) {
    const bool begins = (static_cast<unsigned char>(text[at]) & 0xc0) != 0x80;
    if (begins && characters++ == columns) break;
  }
  return text.substr(0, at);
}

}  // namespace comap
