#include "common/dds/credentials.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <string>

#include "tests/support/keys.h"

namespace gatefield::dds {
namespace {

namespace fs = std::filesystem;

constexpr Identity kOwn{Role::kVehicle, "drone"};

/// A vehicle's folder that may be spoiled.
class CredentialsTest : public ::testing::Test {
 protected:
  static test::Keys& keys() {
    static test::Keys made("credentials");
    return made;
  }
  void SetUp() override { fs::copy(keys().make("vehicle", "drone"), folder_, fs::copy_options::recursive); }
  void TearDown() override { fs::remove_all(folder_); }

  /// The sentence; empty: nothing is wrong.
  std::string problem(const Identity& wanted = kOwn) const {
    const auto read = read_credentials(folder_, wanted);
    if (read.ok()) return {};
    EXPECT_EQ(read.failure().field, "security");
    return read.error();
  }
  void shell(const std::string& command) const {
    ASSERT_EQ(std::system(("cd " + folder_.string() + " && (" + command + ") >said 2>&1").c_str()), 0) << command;
  }
  static std::string authority() { return keys().authority().string(); }
  /// Signs a text anew by the permissions' authority, after `edit` (of sed) changed it.
  void sign_anew(const std::string& file, const std::string& edit) const {
    shell("openssl smime -verify -noverify -text -in " + file + ".p7s | sed '" + edit +
          "' | openssl smime -sign -text -md sha256 -out new -signer " + authority() + "/permissions-ca.pem -inkey " +
          authority() + "/permissions-ca.key && mv new " + file + ".p7s");
  }
  void expect_problem(const std::string& words, const Identity& wanted = kOwn) const {
    EXPECT_NE(problem(wanted).find(words), std::string::npos) << "\"" << problem(wanted) << "\", expected: " << words;
  }

  const fs::path folder_ = keys().folder() / "spoiled";
};

TEST_F(CredentialsTest, WhatGatefieldKeysMadeIsInOrder) {
  EXPECT_EQ(problem(), "");
  EXPECT_EQ(problem({Role::kVehicle, ""}), "");
  EXPECT_EQ(read_credentials(folder_, {Role::kVehicle, ""})->identity.name, "drone");
  for (const auto& entry : fs::directory_iterator(folder_)) {
    EXPECT_EQ(entry.status().permissions() & fs::perms(077), fs::perms::none) << entry.path();
    std::ifstream in(entry.path());
    const std::string content{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    for (const char* key : {"/identity-ca.key", "/permissions-ca.key"}) {
      std::ifstream authoritys(authority() + key);
      const std::string secret{std::istreambuf_iterator<char>(authoritys), std::istreambuf_iterator<char>()};
      ASSERT_FALSE(secret.empty());
      EXPECT_EQ(content.find(secret), std::string::npos) << entry.path() << " holds an authority's key";
    }
  }
}

TEST_F(CredentialsTest, AFolderThatIsNotThereOrNotWhole) {
  const auto nowhere = read_credentials("/nowhere", kOwn);
  ASSERT_FALSE(nowhere.ok());
  EXPECT_NE(nowhere.error().find("\"/nowhere\", expected a folder of a vehicle"), std::string::npos) << nowhere.error();
  for (const char* file : {"identity-ca.pem", "permissions-ca.pem", "certificate.pem", "key.pem", "governance.p7s",
                           "permissions.p7s", "revoked.crl"}) {
    fs::rename(folder_ / file, folder_ / "away");
    expect_problem(file);
    std::ofstream(folder_ / file) << "rubbish\n";
    fs::permissions(folder_ / file, fs::perms::owner_read | fs::perms::owner_write);
    expect_problem(file);
    fs::rename(folder_ / "away", folder_ / file);
  }
  EXPECT_EQ(problem(), "");
}

TEST_F(CredentialsTest, AnotherNameOrRole) {
  expect_problem("certificate.pem is of \"CN=drone,OU=vehicle,O=Gatefield\", expected vehicle \"rival\"",
                 {Role::kVehicle, "rival"});
  expect_problem("expected server \"drone\"", {Role::kServer, "drone"});
  expect_problem("expected tool", {Role::kTool, ""});
}

TEST_F(CredentialsTest, AKeyThatOthersReadOrThatIsAnothers) {
  shell("chmod 640 key.pem");
  expect_problem("key.pem may be read by others; run: chmod 600");
  shell("openssl ecparam -name prime256v1 -genkey -noout -out key.pem && chmod 600 key.pem");
  expect_problem("key.pem is not the key of certificate.pem");
}

TEST_F(CredentialsTest, ACertificateThatExpired) {
  shell("export GATEFIELD_AUTHORITY=" + authority() +
        " && openssl req -new -key key.pem -out request -config $GATEFIELD_AUTHORITY/openssl.cnf -subj "
        "/O=Gatefield/OU=vehicle/CN=drone && openssl ca -batch -notext -config $GATEFIELD_AUTHORITY/openssl.cnf -in "
        "request -out certificate.pem -startdate 20200101000000Z -enddate 20210101000000Z");
  expect_problem("certificate has expired");
  expect_problem("gatefield-keys vehicle drone --renew");
}

TEST_F(CredentialsTest, ACertificateThatWasRevoked) {
  keys().make("vehicle", "thief");
  fs::remove_all(folder_);
  fs::copy(keys().make("vehicle", "thief"), folder_, fs::copy_options::recursive);
  keys().must({"revoke", "thief"});
  EXPECT_EQ(problem({Role::kVehicle, "thief"}), "") << "its own list is old";
  shell("cp " + authority() + "/revoked.crl revoked.crl");
  expect_problem("certificate revoked", {Role::kVehicle, "thief"});
}

TEST_F(CredentialsTest, AuthoritiesThatAreNot) {
  static test::Keys others("others");
  shell("cp permissions-ca.pem kept && cp " + others.authority().string() + "/identity-ca.pem identity-ca.pem");
  expect_problem("certificate.pem can't be used");
  shell("cp " + authority() + "/identity-ca.pem identity-ca.pem && cp identity-ca.pem permissions-ca.pem");
  expect_problem("everybody could sign permissions for himself");
  shell("cp " + others.authority().string() + "/permissions-ca.pem permissions-ca.pem");
  expect_problem("governance.p7s was not signed by the authority of permissions-ca.pem");
  shell("cp certificate.pem permissions-ca.pem");
  expect_problem("permissions-ca.pem is no authority's certificate");
}

TEST_F(CredentialsTest, RulesThatAskForLess) {
  sign_anew("governance", "s/<allow_unauthenticated_participants>false/<allow_unauthenticated_participants>true/");
  expect_problem("has allow_unauthenticated_participants true, expected false");
  sign_anew("governance",
            "s/participants>true/participants>false/; s/metadata_protection_kind>[A-Z_]*</"
            "metadata_protection_kind>NONE</");
  expect_problem("has metadata_protection_kind NONE, expected ENCRYPT_WITH_ORIGIN_AUTHENTICATION");
}

TEST_F(CredentialsTest, PermissionsOfAnotherOrOfThePast) {
  sign_anew("permissions", "s/CN=drone/CN=rival/");
  expect_problem("permissions.p7s is of \"CN=rival,OU=vehicle,O=Gatefield\"");
  sign_anew("permissions", "s/CN=rival/CN=drone/; s/<not_after>[^<]*/<not_after>2021-01-01T00:00:00/");
  expect_problem("permissions.p7s holds no more");
  sign_anew("permissions", "s/2021-01-01/2031-01-01/");
  EXPECT_EQ(problem(), "");
  shell("sed -i s/DENY/ALLOW/ permissions.p7s");
  expect_problem("permissions.p7s was not signed by the authority");
}

TEST_F(CredentialsTest, AMarkIsItsNamesAndRolesOwn) {
  const IdentityMark mark = mark_of(kOwn);
  EXPECT_NE(mark[0] & 0x80, 0);
  EXPECT_NE(mark, mark_of({Role::kVehicle, "drone2"}));
  EXPECT_NE(mark, mark_of({Role::kServer, "drone"}));
  ParticipantId participant;
  std::copy(mark.begin(), mark.end(), participant.bytes.begin());
  EXPECT_TRUE(bears(participant, mark));
  participant.bytes[5] ^= 1;
  EXPECT_FALSE(bears(participant, mark));
}

TEST(GatefieldKeys, SaysWhatIsWrong) {
  const test::Keys keys("words");
  const auto [code, said] = keys.run({"vehicle", "a b"});
  EXPECT_EQ(code, 2);
  EXPECT_NE(said.find("the name is 'a b', expected 1 to 63"), std::string::npos) << said;
  keys.make("vehicle", "drone");
  EXPECT_EQ(keys.run({"server", "drone"}).first, 2) << "a name has one owner";
  EXPECT_EQ(keys.run({"revoke", "nobody"}).first, 2);
  EXPECT_EQ(keys.run({"vehicle", "drone"}).first, 0) << "once more changes nothing";
  const auto [listed, list] = keys.run({"list"});
  EXPECT_EQ(listed, 0);
  EXPECT_NE(list.find("vehicle  drone"), std::string::npos) << list;
  const auto [again, renewed] = keys.run({"vehicle", "drone", "--renew"});
  EXPECT_EQ(again, 0) << renewed;
  EXPECT_NE(keys.run({"list"}).second.find("revoked: 1"), std::string::npos);
}

}  // namespace
}  // namespace gatefield::dds
