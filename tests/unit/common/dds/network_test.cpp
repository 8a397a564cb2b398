#include "common/dds/network.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "common/dds/environment.h"
#include "common/dds/reach.h"

namespace gatefield::dds {
namespace {

NetworkOptions with_peer(const std::string& peer) {
  NetworkOptions options;
  options.peers = {peer};
  return options;
}

/// Sets a variable for one test.
class Variable {
 public:
  Variable(const char* name, const char* value) : name_(name) { setenv(name, value, 1); }
  ~Variable() { unsetenv(name_); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
};

TEST(Network, PeersAreHostsWithNumbersOfParticipants) {
  const auto reach = resolve(with_peer("127.0.0.1:3-24"));
  ASSERT_TRUE(reach.ok()) << reach.error();
  ASSERT_EQ(reach->peers.size(), 1u);
  EXPECT_EQ(reach->peers[0].address, "127.0.0.1");
  EXPECT_EQ(reach->peers[0].first, 3);
  EXPECT_EQ(reach->peers[0].last, 24);
  EXPECT_EQ(resolve(with_peer("127.0.0.1"))->peers[0].last, 9);
  EXPECT_EQ(resolve(with_peer("localhost:5"))->peers[0].first, 5);
  EXPECT_EQ(resolve(with_peer("localhost:5"))->peers[0].address, "127.0.0.1");
}

TEST(Network, PeersThatAreNoneAreRefusedWithTheirFieldAndASentence) {
  for (const char* bad : {"", ":", "10.0.0.7:", "10.0.0.7:5-4", "10.0.0.7:0-119", "10.0.0.7:-1", "a b",
                          "10.0.0.7:1-2-3", "udp://10.0.0.7", "fe80::1", "10.0.0.7;rm"}) {
    const Status status = validate(with_peer(bad));
    ASSERT_FALSE(status.ok()) << bad;
    EXPECT_EQ(status.failure().code, ErrorCode::kInvalid);
    EXPECT_EQ(status.failure().field, "peers");
    EXPECT_EQ(status.failure().value, bad);
    EXPECT_NE(status.error().find("HOST:FIRST-LAST"), std::string::npos) << status.error();
  }
}

TEST(Network, ListsHaveAnEnd) {
  NetworkOptions options;
  options.peers.assign(kMaxPeers + 1, "10.0.0.7");
  EXPECT_EQ(validate(options).error(), "peers is 65 of them, expected at most 64");
}

TEST(Network, AHostThatNobodyKnowsIsNamed) {
  const auto reach = resolve(with_peer("no-such-host.invalid"));
  ASSERT_FALSE(reach.ok());
  EXPECT_EQ(reach.failure().code, ErrorCode::kUnknownName);
  EXPECT_NE(reach.error().find("'no-such-host.invalid'"), std::string::npos) << reach.error();
}

TEST(Network, InterfacesAreFoundByNameAndByAddress) {
  NetworkOptions options;
  for (const char* name : {"lo", "127.0.0.1"}) {
    options.interfaces = {name};
    const auto reach = resolve(options);
    ASSERT_TRUE(reach.ok()) << reach.error();
    EXPECT_EQ(reach->interfaces, std::vector<std::string>{"127.0.0.1"});
  }
  options.interfaces = {"eth777"};
  const auto none = resolve(options);
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().find("lo 127.0.0.1"), std::string::npos) << none.error();
}

TEST(Network, DiscoveryServersAreCountedInTheirOrder) {
  NetworkOptions options;
  options.discovery_servers = {"127.0.0.1:11811", "localhost:11812"};
  const auto reach = resolve(options);
  ASSERT_TRUE(reach.ok()) << reach.error();
  EXPECT_EQ(reach->discovery_servers[1].id, 1);
  EXPECT_EQ(reach->discovery_servers[1].port, 11812);
  options.discovery_servers = {"127.0.0.1:0"};
  EXPECT_FALSE(validate(options).ok());
  options.discovery_servers = {"127.0.0.1"};
  EXPECT_FALSE(validate(options).ok());
}

TEST(Network, PeersAndDiscoveryServersAreNotMixed) {
  NetworkOptions options = with_peer("127.0.0.1");
  options.discovery_servers = {"127.0.0.1:11811"};
  EXPECT_EQ(validate(options).failure().field, "peers");
}

TEST(Network, AClosedDomainAsksNoDiscoveryServer) {
  NetworkOptions options;
  options.security = "/keys/vehicles/drone";
  EXPECT_TRUE(validate(options).ok());
  {
    const Variable servers("ROS_DISCOVERY_SERVER", "127.0.0.1");
    EXPECT_EQ(resolve(options).failure().field, "security");
  }
  options.discovery_servers = {"127.0.0.1:11811"};
  EXPECT_EQ(validate(options).failure().field, "security");
}

TEST(Environment, RosDiscoveryServerIsTakenOrRefusedWhole) {
  const Variable servers("ROS_DISCOVERY_SERVER", ";127.0.0.1:7777;localhost");
  const auto reach = resolve({});
  ASSERT_TRUE(reach.ok()) << reach.error();
  ASSERT_EQ(reach->discovery_servers.size(), 2u);
  EXPECT_EQ(reach->discovery_servers[0].id, 1);
  EXPECT_EQ(reach->discovery_servers[0].port, 7777);
  EXPECT_EQ(reach->discovery_servers[1].id, 2);
  EXPECT_EQ(reach->discovery_servers[1].port, 11811);
  EXPECT_EQ(resolve(with_peer("127.0.0.1")).failure().field, "peers");
  const Variable broken("ROS_DISCOVERY_SERVER", "127.0.0.1:port");
  EXPECT_EQ(resolve({}).failure().field, "ROS_DISCOVERY_SERVER");
}

TEST(Environment, WhatWouldBeHalfAppliedIsNamedAndTakenAway) {
  const Variable profiles("FASTRTPS_DEFAULT_PROFILES_FILE", "/etc/profiles.xml");
  const Variable file("FASTDDS_ENVIRONMENT_FILE", "/etc/dds.json");
  const Variable statistics("FASTDDS_STATISTICS", "HISTORY_LATENCY_TOPIC");
  const Variable servers("ROS_DISCOVERY_SERVER", "127.0.0.1");
  const auto sentences = settle_environment({});
  ASSERT_EQ(sentences.size(), 4u);
  EXPECT_NE(sentences[0].find("FASTRTPS_DEFAULT_PROFILES_FILE is set (/etc/profiles.xml) and not read"),
            std::string::npos);
  EXPECT_NE(sentences[3].find("taken as --discovery-server"), std::string::npos);
  EXPECT_EQ(std::getenv("FASTRTPS_DEFAULT_PROFILES_FILE"), nullptr);
  EXPECT_EQ(std::getenv("FASTDDS_ENVIRONMENT_FILE"), nullptr);
  EXPECT_EQ(std::getenv("FASTDDS_STATISTICS"), nullptr);
  EXPECT_EQ(settle_environment({}).size(), 1u);  // ROS_DISCOVERY_SERVER is honoured, and stays
}

TEST(Environment, AFileThatAsksForSecurityIsRefusedAndNotForgotten) {
  const auto folder = std::filesystem::temp_directory_path() / ("gatefield-environment-" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  const std::string plain = folder / "plain.xml", secured = folder / "secured.xml";
  std::ofstream(plain) << "<profiles><participant/></profiles>";
  std::ofstream(secured) << "<property><name>dds.sec.auth.plugin</name><value>builtin.PKI-DH</value></property>";
  {
    const Variable profiles("FASTRTPS_DEFAULT_PROFILES_FILE", plain.c_str());
    EXPECT_TRUE(check_environment({}).ok());
  }
  for (const char* name : {"FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE"}) {
    const Variable profiles(name, secured.c_str());
    for (int i = 0; i < 2; ++i) {
      const Status status = check_environment({});
      ASSERT_FALSE(status.ok());
      EXPECT_EQ(status.failure().field, "security");
      EXPECT_NE(status.error().find(secured), std::string::npos) << status.error();
      settle_environment({});  // what a program says at its start doesn't hide it
    }
    NetworkOptions closed;
    closed.security = "/keys/drone";
    EXPECT_TRUE(check_environment(closed).ok());
  }
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace gatefield::dds
