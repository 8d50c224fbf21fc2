#include "tests/end_to_end/browser.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace comap {
namespace {

using Json = nlohmann::json;

constexpr int kAnswer_s = 60;

std::string fromBase64(const std::string& text) {
  std::string bytes;
  uint32_t held = 0;
  int bits = 0;
  for (const char c : text) {
    const int value = c >= 'A' && c <= 'Z'   ? c - 'A'
                      : c >= 'a' && c <= 'z' ? c - 'a' + 26
                      : c >= '0' && c <= '9' ? c - '0' + 52
                      : c == '+'             ? 62
                      : c == '/'             ? 63
                                             : -1;
    if (value < 0) break;
    held = held << 6 | static_cast<uint32_t>(value);
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes.push_back(static_cast<char>(held >> bits & 0xff));
  }
  return bytes;
}

}  // namespace

std::string findBrowser() {
  if (const char* named = std::getenv("COMAP_BROWSER_PROGRAM")) return named;
  const char* path = std::getenv("PATH");
  for (const char* name : {"chromium", "chromium-browser", "google-chrome"}) {
    std::istringstream folders(path != nullptr ? path : "");
    for (std::string folder; std::getline(folders, folder, ':');)
      if (const std::string file = folder + "/" + name; access(file.c_str(), X_OK) == 0) return file;
  }
  return {};
}

Browser::Browser(const std::string& program, int width, int height) {
  // The browser reads commands from descriptor 3 and answers on 4, each message ended by a zero byte.
  int commands[2], answers[2];
  if (pipe2(commands, O_CLOEXEC) != 0 || pipe2(answers, O_CLOEXEC) != 0) throw std::runtime_error("no pipes");
  std::vector<std::string> words = {program,
                                    "--headless",
                                    "--no-sandbox",
                                    "--use-angle=swiftshader",
                                    "--enable-unsafe-swiftshader",
                                    "--disable-quic",
                                    "--no-first-run",
                                    "--disable-background-networking",
                                    "--disable-component-update",
                                    "--disable-sync",
                                    "--disable-dev-shm-usage",
                                    "--user-data-dir=" + profile_.path("profile"),
                                    "--window-size=" + std::to_string(width) + "," + std::to_string(height),
                                    "--remote-debugging-pipe",
                                    "about:blank"};
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const int null = ::open("/dev/null", O_RDWR | O_CLOEXEC);
  pid_ = fork();
  if (pid_ == 0) {
    setpgid(0, 0);  // it starts many processes of its own
    const int in = fcntl(commands[0], F_DUPFD, 10), out = fcntl(answers[1], F_DUPFD, 10);
    for (const int standard : {0, 1, 2}) dup2(null, standard);
    dup2(in, 3);
    dup2(out, 4);
    close(in);
    close(out);
    execv(argv[0], argv.data());
    _exit(127);
  }
  close(null);
  close(commands[0]);
  close(answers[1]);
  to_ = commands[1];
  from_ = answers[0];
  signal(SIGPIPE, SIG_IGN);
  const Json page = command("Target.createTarget", {{"url", "about:blank"}}).at("targetId");
  session_ =
      command("Target.attachToTarget", {{"targetId", page}, {"flatten", true}}).at("sessionId").get<std::string>();
  for (const char* domain : {"Page", "Runtime", "Log", "Network"}) command(domain + std::string(".enable"));
  command("Emulation.setDeviceMetricsOverride",
          {{"width", width}, {"height", height}, {"deviceScaleFactor", 1}, {"mobile", false}});
}

Browser::~Browser() {
  close(to_);
  close(from_);
  kill(-pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

Json Browser::receive(int seconds) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(seconds);
  size_t end = 0;
  while ((end = buffer_.find('\0')) == std::string::npos) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now()).count();
    pollfd waiting{from_, POLLIN, 0};
    if (left <= 0 || poll(&waiting, 1, static_cast<int>(left)) <= 0)
      throw std::runtime_error("the browser does not answer");
    char bytes[65536];
    const ssize_t got = read(from_, bytes, sizeof bytes);
    if (got <= 0) throw std::runtime_error("the browser has ended");
    buffer_.append(bytes, static_cast<size_t>(got));
  }
  Json message = Json::parse(buffer_.substr(0, end));
  buffer_.erase(0, end + 1);
  return message;
}

Json Browser::command(const std::string& method, const Json& parameters) {
  Json message = {{"id", ++commands_}, {"method", method}, {"params", parameters}};
  if (!session_.empty()) message["sessionId"] = session_;
  std::string text = message.dump();
  text.push_back('\0');
  for (size_t sent = 0; sent < text.size();) {
    const ssize_t wrote = write(to_, text.data() + sent, text.size() - sent);
    if (wrote <= 0) throw std::runtime_error("the browser has ended");
    sent += static_cast<size_t>(wrote);
  }
  while (true) {
    Json answer = receive(kAnswer_s);
    if (answer.value("id", 0) != commands_) {
      events_.push_back(std::move(answer));
      continue;
    }
    if (answer.contains("error")) throw std::runtime_error(method + ": " + answer["error"].dump());
    return answer.at("result");
  }
}

void Browser::open(const std::string& url) {
  const Json result = command("Page.navigate", {{"url", url}});
  if (result.contains("errorText")) throw std::runtime_error(url + ": " + result["errorText"].get<std::string>());
}

Json Browser::evaluate(const std::string& expression) {
  const Json result =
      command("Runtime.evaluate", {{"expression", expression}, {"awaitPromise", true}, {"returnByValue", true}});
  if (result.contains("exceptionDetails"))
    throw std::runtime_error(expression + ": " + result["exceptionDetails"].dump());
  return result.at("result").value("value", Json());
}

bool Browser::waitFor(const std::string& expression, int seconds) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(seconds);
  while (evaluate("!!(" + expression + ")") != true) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return true;
}

void Browser::click(double x, double y) {
  for (const char* type : {"mouseMoved", "mousePressed", "mouseReleased"}) {
    const bool button = type != std::string("mouseMoved");
    command("Input.dispatchMouseEvent",
            {{"type", type}, {"x", x}, {"y", y}, {"button", button ? "left" : "none"}, {"clickCount", button ? 1 : 0}});
  }
}

void Browser::tap(double x, double y) {
  command("Input.dispatchTouchEvent",
          {{"type", "touchStart"}, {"touchPoints", Json::array({Json{{"x", x}, {"y", y}}})}});
  command("Input.dispatchTouchEvent", {{"type", "touchEnd"}, {"touchPoints", Json::array()}});
}

void Browser::pinch(double x, double y, double other_x, double other_y) {
  const auto touch = [&](const char* type, const Json& points) {
    command("Input.dispatchTouchEvent", {{"type", type}, {"touchPoints", points}});
  };
  const auto finger = [](int id, double at_x, double at_y) { return Json{{"id", id}, {"x", at_x}, {"y", at_y}}; };
  touch("touchStart", Json::array({finger(1, x, y)}));
  touch("touchStart", Json::array({finger(1, x, y), finger(2, other_x, other_y)}));
  for (int step = 1; step <= 8; ++step)
    touch("touchMove", Json::array({finger(1, x, y), finger(2, other_x + 10 * step, other_y)}));
  touch("touchEnd", Json::array({finger(1, x, y)}));
  touch("touchEnd", Json::array());
}

void Browser::screenshot(const std::string& file) {
  const Json jpeg = {{"format", "jpeg"}, {"quality", 85}};
  const Json result = command("Page.captureScreenshot", file.ends_with(".jpg") ? jpeg : Json::object());
  std::ofstream(file, std::ios::binary) << fromBase64(result.at("data").get<std::string>());
}

std::vector<std::string> Browser::complaints() {
  evaluate("0");  // takes in what has been said so far
  std::vector<std::string> found;
  for (const Json& event : events_) {
    const std::string method = event.value("method", "");
    const Json parameters = event.value("params", Json::object());
    const std::string type = parameters.value("type", "");
    const bool logged =
        method == "Log.entryAdded" || (method == "Runtime.consoleAPICalled" && (type == "error" || type == "warning"));
    if (logged || method == "Runtime.exceptionThrown" || method == "Network.loadingFailed")
      found.push_back(parameters.dump());
  }
  return found;
}

}  // namespace comap
