#include "protocol/program/service_arguments.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace comap
