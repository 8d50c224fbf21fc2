#include "protocol/discovery/endpoint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace comap {
namespace {

TEST(HostPort, TakesAddressesNamesAndPorts) {
  for (const auto& [text, host, port] :
       {std::tuple("10.0.0.1", "10.0.0.1", 7399), std::tuple("10.0.0.1:11811", "10.0.0.1", 11811),
        std::tuple("discovery", "discovery", 7399), std::tuple("core.site-1.example:1", "core.site-1.example", 1)}) {
    const auto parsed = parseHostPort(text, "link.discovery_server");
    ASSERT_TRUE(parsed) << text;
    EXPECT_EQ(parsed->host, host);
    EXPECT_EQ(parsed->port, port);
  }
}

TEST(HostPort, RefusesWhatIsNeither) {
  for (const char* text : {"", ":7399", "10.0.0.1:", "10.0.0.1:0", "10.0.0.1:65536", "10.0.0.1:-1", "10.0.0.1:7399x",
                           "::1", "a b", "host/7399", "10.0.0", "300.0.0.1"}) {
    const auto parsed = parseHostPort(text, "link.discovery_server");
    ASSERT_FALSE(parsed) << text;
    EXPECT_EQ(parsed.error().code, ErrorCode::kWrongUse);
    EXPECT_THAT(parsed.error().text, testing::HasSubstr(std::string("link.discovery_server '") + text));
  }
}

TEST(DatagramSocket, CarriesDatagramsAndWakes) {
  const auto a = DatagramSocket::bind({0x7f000001, 0, 0});
  const auto b = DatagramSocket::bind({0x7f000001, 0, 0});
  ASSERT_TRUE(a && b);
  a->send({0x7f000001, b->port(), 0}, std::vector<uint8_t>{1, 2, 3});
  Endpoint from;
  const auto got = b->receive(std::chrono::seconds(10), from);
  ASSERT_TRUE(got);
  EXPECT_EQ(*got, (std::vector<uint8_t>{1, 2, 3}));
  EXPECT_EQ(from, (Endpoint{0x7f000001, a->port(), 0x7f000001}));
  EXPECT_EQ(toString(from), "127.0.0.1:" + std::to_string(a->port()));
  // A socket on all addresses answers from the one that was asked.
  const auto all = DatagramSocket::bind({0, 0, 0});
  ASSERT_TRUE(all);
  a->send({0x7f000002, all->port(), 0}, std::vector<uint8_t>{4});
  Endpoint asker;
  ASSERT_TRUE(all->receive(std::chrono::seconds(10), asker));
  EXPECT_EQ(asker, (Endpoint{0x7f000001, a->port(), 0x7f000002}));
  all->send(asker, std::vector<uint8_t>{5});
  Endpoint answerer;
  ASSERT_TRUE(a->receive(std::chrono::seconds(10), answerer));
  EXPECT_TRUE(isSameHostPort(answerer, {0x7f000002, all->port(), 0})) << toString(answerer);
  b->wake();
  EXPECT_FALSE(b->receive(std::chrono::hours(1), from)) << "woken";
  const auto taken = DatagramSocket::bind({0x7f000001, a->port(), 0});
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().code, ErrorCode::kUnreachable);
  EXPECT_THAT(taken.error().text, testing::HasSubstr(toString(from)));
}

}  // namespace
}  // namespace comap
