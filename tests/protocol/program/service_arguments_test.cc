#include "protocol/program/service_arguments.h"

#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

TEST(ServiceArguments, theManualPageHasAllOptions) {
  ServiceArguments arguments;
  CLI::App app("Serves robots.", "server");
  app.footer("Example: server --store x");
  addServiceOptions(app, arguments, "Site that is served", "Publish the map");
  app.add_option("--store", "Where it is kept");
  try {
    app.parse("--man");
    FAIL() << "the page is not asked for";
  } catch (const CLI::CallForVersion& page) {
    const std::string text = page.what();
    EXPECT_EQ(page.get_exit_code(), 0);
    EXPECT_TRUE(text.starts_with(".TH SERVER 1 ")) << text.substr(0, 40);
    for (const char* word : {"Serves robots.", "status\\-port", "Site that is served", "store", "Example: server"})
      EXPECT_NE(text.find(word), std::string::npos) << word;
  }
}

TEST(ServiceArguments, whatIsGivenGoesBeforeTheConfiguration) {
  ServiceArguments arguments;
  CLI::App app("Serves robots.", "server");
  addServiceOptions(app, arguments, "Site", "Map");
  app.parse("--core-site north --domain 7 --status-port 0 --log-format json --insecure");
  DdsLinkOptions link;
  link.site = "south";
  link.domain = 3;
  link.interface_address = "10.0.0.1";
  TelemetryOptions telemetry;
  ros2::Ros2Options ros2;
  ASSERT_TRUE(apply(arguments, "server", "", link, telemetry, ros2));
  EXPECT_EQ(link.site, "north");
  EXPECT_EQ(link.domain, 7);
  EXPECT_EQ(link.interface_address, "10.0.0.1") << "not given: as configured";
  EXPECT_TRUE(link.insecure);
  EXPECT_EQ(telemetry.status_port, 0);
  EXPECT_EQ(telemetry.log_format, "json");
}

TEST(ServiceArguments, aShellCompletesItsOptions) {
  ServiceArguments arguments;
  CLI::App app("Serves robots.", "server");
  addServiceOptions(app, arguments, "Site", "Map");
  for (const std::string shell : {"bash", "zsh"}) {
    try {
      app.parse("--completion " + shell);
      FAIL() << "the script is not asked for";
    } catch (const CLI::CallForVersion& script) {
      const std::string text = script.what();
      EXPECT_EQ(script.get_exit_code(), 0);
      for (const char* word : {"server", "--status-port", "--log-format"})
        EXPECT_NE(text.find(word), std::string::npos) << shell << " lacks " << word;
    }
  }
}

std::string toldBy(const std::function<void()>& program) {
  testing::internal::CaptureStderr();
  program();
  return testing::internal::GetCapturedStderr();
}

TEST(ServiceArguments, aWrongCommandLineIsToldInTheFormatThatIsAskedFor) {
  ServiceArguments arguments;
  CLI::App app("Serves robots.", "server");
  addServiceOptions(app, arguments, "Site", "Map");
  const char* const json[] = {"server", "--domain", "999", "--log-format=json"};
  const std::string line = toldBy([&] { EXPECT_EQ(parse(app, 4, json, earlyLog(4, json, "server")), 2); });
  const auto told = nlohmann::json::parse(line);
  EXPECT_EQ(told.at("level"), "error");
  EXPECT_NE(told.at("text").get<std::string>().find("999"), std::string::npos) << line;
  const char* const text[] = {"server", "--no-such-thing"};
  EXPECT_TRUE(toldBy([&] { EXPECT_EQ(parse(app, 2, text, earlyLog(2, text, "server")), 2); }).starts_with("server: "));
  const char* const right[] = {"server", "--domain", "9"};
  EXPECT_EQ(parse(app, 3, right, earlyLog(3, right, "server")), std::nullopt);
}

TEST(ServiceArguments, aWrongConfigurationIsToldInTheFormatThatItAsksFor) {
  const TemporaryFolder folder;
  std::ofstream(folder.path("c.yaml")) << "log: {format: json}\nno_such_key: 1\n";
  const std::string path = folder.path("c.yaml");
  const char* const words[] = {"server", "--config", path.c_str()};
  EXPECT_TRUE(nlohmann::json::accept(toldBy([&] { earlyLog(3, words, "server").error("bad"); })));
  const char* const nowhere[] = {"server", "--config", "/nonexistent"};
  EXPECT_EQ(toldBy([&] { earlyLog(3, nowhere, "server").error("bad"); }), "server: bad\n");
}

}  // namespace
}  // namespace comap
