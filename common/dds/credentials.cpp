#include "common/dds/credentials.h"

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/pkcs7.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>

#include <algorithm>
#include <ctime>
#include <initializer_list>
#include <iomanip>
#include <memory>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/whole_file.h"
#include "common/protocol/messages.h"

namespace gatefield::dds {
namespace {

constexpr std::size_t kLongestFile = 1 << 20;
constexpr std::string_view kProtection = "ENCRYPT_WITH_ORIGIN_AUTHENTICATION";

template <auto kFree>
struct Frees {
  template <typename T>
  void operator()(T* object) const {
    kFree(object);
  }
};
using Bio = std::unique_ptr<BIO, Frees<BIO_free>>;
using Certificate = std::unique_ptr<X509, Frees<X509_free>>;
using RevocationList = std::unique_ptr<X509_CRL, Frees<X509_CRL_free>>;
using Key = std::unique_ptr<EVP_PKEY, Frees<EVP_PKEY_free>>;
using Name = std::unique_ptr<X509_NAME, Frees<X509_NAME_free>>;
using Signed = std::unique_ptr<PKCS7, Frees<PKCS7_free>>;
using Store = std::unique_ptr<X509_STORE, Frees<X509_STORE_free>>;
using StoreContext = std::unique_ptr<X509_STORE_CTX, Frees<X509_STORE_CTX_free>>;

Error wrong(const std::filesystem::path& file, const std::string& what) {
  Error error(file.string() + " " + what, ErrorCode::kUnreadable, "security");
  error.file = file.string();
  return error;
}

Result<Bio> open(const std::filesystem::path& file) {
  const auto content = read_file(file, kLongestFile);
  if (!content) {
    Error error = content.failure();
    error.field = "security";
    return error;
  }
  Bio memory(BIO_new(BIO_s_mem()));
  if (!memory || BIO_write(memory.get(), content->data(), static_cast<int>(content->size())) < 0)
    return wrong(file, "could not be kept in memory");
  return memory;
}

/// Reads one object of a PEM file. @param read  PEM_read_bio_..
template <typename Owner, typename Read>
Result<Owner> read_pem(const std::filesystem::path& file, const char* kind, Read read) {
  auto in = open(file);
  if (!in) return in.failure();
  Owner object(read(in->get(), nullptr, nullptr, nullptr));
  if (!object) return wrong(file, std::string("holds no ") + kind + " in PEM; make it anew with gatefield-keys");
  return object;
}

Name subject_of(const Identity& identity) {
  Name name(X509_NAME_new());
  const auto add = [&](const char* field, const std::string& text) {
    X509_NAME_add_entry_by_txt(name.get(), field, MBSTRING_UTF8, reinterpret_cast<const unsigned char*>(text.data()),
                               static_cast<int>(text.size()), -1, 0);
  };
  add("O", "Gatefield");
  add("OU", role_name(identity.role));
  add("CN", identity.name);
  return name;
}

std::string text_of(const X509_NAME* name) {
  const Bio out(BIO_new(BIO_s_mem()));
  X509_NAME_print_ex(out.get(), name, 0, XN_FLAG_RFC2253);
  char* text = nullptr;
  const auto length = BIO_get_mem_data(out.get(), &text);
  return {text, static_cast<std::size_t>(std::max(0L, length))};
}

std::string common_name(const X509* certificate) {
  char text[protocol::kMaxNameLength + 2] = "";
  X509_NAME_get_text_by_NID(X509_get_subject_name(certificate), NID_commonName, text, sizeof text);
  return text;
}

/// The certificate is an authority's, signed by itself, and holds now.
Status check_authority(const std::filesystem::path& file, X509* authority) {
  if (X509_check_ca(authority) != 1 || X509_verify(authority, X509_get0_pubkey(authority)) != 1)
    return wrong(file, "is no authority's certificate; take the folder as gatefield-keys made it");
  if (X509_cmp_current_time(X509_get0_notBefore(authority)) > 0 ||
      X509_cmp_current_time(X509_get0_notAfter(authority)) < 0)
    return wrong(file, "does not hold today; check the clock, or begin anew with gatefield-keys init");
  return {};
}

Store store_of(X509* authority, X509_CRL* revoked) {
  Store store(X509_STORE_new());
  X509_STORE_add_cert(store.get(), authority);
  if (revoked != nullptr) {
    X509_STORE_add_crl(store.get(), revoked);
    X509_STORE_set_flags(store.get(), X509_V_FLAG_CRL_CHECK);
  }
  return store;
}

std::string next_step(int problem, const Identity& who) {
  switch (problem) {
    case X509_V_ERR_CERT_HAS_EXPIRED:
      return "renew it with: gatefield-keys " + std::string(role_name(who.role)) + " " + who.name + " --renew";
    case X509_V_ERR_CERT_NOT_YET_VALID:
      return "check this machine's clock";
    case X509_V_ERR_CERT_REVOKED:
      return "if it shall take part again: gatefield-keys " + std::string(role_name(who.role)) + " " + who.name;
    default:
      return "take the folder as gatefield-keys made it";
  }
}

Status check_certificate(const Credentials& files, X509* certificate, X509* authority, X509_CRL* revoked) {
  const Store store = store_of(authority, revoked);
  const StoreContext context(X509_STORE_CTX_new());
  if (!context || X509_STORE_CTX_init(context.get(), store.get(), certificate, nullptr) != 1)
    return wrong(files.certificate, "could not be checked: OpenSSL is out of memory");
  if (X509_verify_cert(context.get()) == 1) return {};
  const int problem = X509_STORE_CTX_get_error(context.get());
  return wrong(files.certificate, std::string("can't be used (") + X509_verify_cert_error_string(problem) + "); " +
                                      next_step(problem, files.identity));
}

/// The text that the permissions' authority signed, by its own hand: one that only chains up to it doesn't count
/// (CVE-2023-24010 is about that).
Result<std::string> read_signed(const std::filesystem::path& file, X509* authority) {
  auto in = open(file);
  if (!in) return in.failure();
  BIO* detached = nullptr;
  const Signed document(SMIME_read_PKCS7(in->get(), &detached));
  const Bio content(detached);
  if (!document) return wrong(file, "is no signed document (S/MIME); make it anew with gatefield-keys");
  const Store store = store_of(authority, nullptr);
  const Bio out(BIO_new(BIO_s_mem()));
  const bool good = PKCS7_verify(document.get(), nullptr, store.get(), content.get(), out.get(), PKCS7_TEXT) == 1;
  STACK_OF(X509)* const signers = good ? PKCS7_get0_signers(document.get(), nullptr, 0) : nullptr;
  const bool own =
      signers != nullptr && sk_X509_num(signers) == 1 && X509_cmp(sk_X509_value(signers, 0), authority) == 0;
  sk_X509_free(signers);
  if (!own)
    return wrong(file,
                 "was not signed by the authority of permissions-ca.pem, or was changed since; take the folder as "
                 "gatefield-keys made it");
  char* text = nullptr;
  const auto length = BIO_get_mem_data(out.get(), &text);
  return std::string(text, static_cast<std::size_t>(std::max(0L, length)));
}

/// What stands in each element of this name.
std::vector<std::string_view> elements(std::string_view xml, const std::string& name) {
  std::vector<std::string_view> found;
  const std::string begin = "<" + name + ">", end = "</" + name + ">";
  for (std::size_t at = xml.find(begin); at != std::string_view::npos; at = xml.find(begin, at)) {
    at += begin.size();
    found.push_back(xml.substr(at, xml.find(end, at) - at));
  }
  return found;
}

/// Rules that ask for less than ours would let strangers in, or others listen.
Status check_governance(const std::filesystem::path& file, std::string_view rules) {
  const std::initializer_list<std::pair<const char*, std::string_view>> wanted{
      {"allow_unauthenticated_participants", "false"}, {"enable_join_access_control", "true"},
      {"discovery_protection_kind", kProtection},      {"liveliness_protection_kind", kProtection},
      {"metadata_protection_kind", kProtection},       {"enable_discovery_protection", "true"},
      {"enable_liveliness_protection", "true"},        {"enable_read_access_control", "true"},
      {"enable_write_access_control", "true"}};
  for (const auto& [name, value] : wanted) {
    const auto values = elements(rules, name);
    if (values.empty())
      return wrong(file, std::string("says nothing of ") + name + "; make it anew with gatefield-keys");
    for (const std::string_view said : values)
      if (said != value)
        return wrong(file, "has " + std::string(name) + " " + std::string(said.substr(0, 60)) + ", expected " +
                               std::string(value) + "; make it anew with gatefield-keys");
  }
  return {};
}

/// Whether a permission's end, such as 2028-01-01T10:33:36, is to come. The library reads it as local time.
bool is_to_come(std::string_view end) {
  std::tm fields{};
  std::istringstream in{std::string(end)};
  in >> std::get_time(&fields, "%Y-%m-%dT%H:%M:%S");
  return !in.fail() && std::mktime(&fields) > std::time(nullptr);
}

Status check_permissions(const std::filesystem::path& file, std::string_view grants, const std::string& subject) {
  const auto subjects = elements(grants, "subject_name");
  if (subjects.size() != 1 || subjects.front() != subject)
    return wrong(file, "is of \"" + std::string(subjects.empty() ? "" : subjects.front().substr(0, 200)) +
                           "\", expected \"" + subject +
                           "\" as certificate.pem; take the folder as gatefield-keys made it");
  const auto ends = elements(grants, "not_after");
  if (ends.size() != 1 || !is_to_come(ends.front()))
    return wrong(file, "holds no more; renew it with: gatefield-keys .. --renew");
  return {};
}

Status check_key(const std::filesystem::path& file, X509* certificate) {
  struct stat about {};
  if (stat(file.c_str(), &about) != 0) return wrong(file, "can't be read; take the folder as gatefield-keys made it");
  if ((about.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    return wrong(file, "may be read by others; run: chmod 600 " + file.string());
  auto key = read_pem<Key>(file, "private key", PEM_read_bio_PrivateKey);
  if (!key) return key.failure();
  if (X509_check_private_key(certificate, key->get()) != 1)
    return wrong(file, "is not the key of certificate.pem; take both from one run of gatefield-keys");
  return {};
}

Status check_identity(const Credentials& files, const X509* certificate, bool named) {
  const X509_NAME* const subject = X509_get_subject_name(certificate);
  if (X509_NAME_cmp(subject, subject_of(files.identity).get()) == 0) return {};
  const std::string role = role_name(files.identity.role);
  Error error =
      wrong(files.certificate, "is of \"" + text_of(subject) + "\", expected " + role +
                                   (named ? " \"" + files.identity.name + "\"" : "") + "; name the folder of that " +
                                   role + ", or the name that the certificate has");
  error.value = text_of(subject);
  error.expected = text_of(subject_of(files.identity).get());
  return error;
}

}  // namespace

const char* role_name(Role role) noexcept {
  switch (role) {
    case Role::kServer:
      return "server";
    case Role::kVehicle:
      return "vehicle";
    case Role::kTool:
      return "tool";
  }
  return "";
}

IdentityMark mark_of(const Identity& identity) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int length = 0;
  X509_NAME_digest(subject_of(identity).get(), EVP_sha256(), digest.data(), &length);
  // A bit that is set, then the first 47 of the digest.
  IdentityMark mark{};
  std::uint8_t carried = 1;
  for (std::size_t i = 0; i < mark.size(); ++i) {
    mark[i] = static_cast<std::uint8_t>(carried << 7 | digest[i] >> 1);
    carried = digest[i] & 1;
  }
  return mark;
}

Result<Credentials> read_credentials(const std::filesystem::path& folder, const Identity& wanted) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder, ignored))
    return Error::invalid("security", "\"" + folder.string() + "\"",
                          "a folder of a " + std::string(role_name(wanted.role)) + " that gatefield-keys made",
                          ErrorCode::kUnreadable);
  const auto absolute = std::filesystem::absolute(folder, ignored);
  Credentials files{wanted,
                    absolute / "identity-ca.pem",
                    absolute / "permissions-ca.pem",
                    absolute / "certificate.pem",
                    absolute / "key.pem",
                    absolute / "governance.p7s",
                    absolute / "permissions.p7s",
                    absolute / "revoked.crl"};

  const auto read_certificate = PEM_read_bio_X509;
  auto identity_authority = read_pem<Certificate>(files.identity_authority, "certificate", read_certificate);
  if (!identity_authority) return identity_authority.failure();
  auto permissions_authority = read_pem<Certificate>(files.permissions_authority, "certificate", read_certificate);
  if (!permissions_authority) return permissions_authority.failure();
  auto certificate = read_pem<Certificate>(files.certificate, "certificate", read_certificate);
  if (!certificate) return certificate.failure();
  auto revoked = read_pem<RevocationList>(files.revoked, "list of revoked certificates", PEM_read_bio_X509_CRL);
  if (!revoked) return revoked.failure();

  const auto failed = [](const Status& status) { return Result<Credentials>(status.failure()); };
  if (auto s = check_authority(files.identity_authority, identity_authority->get()); !s) return failed(s);
  if (auto s = check_authority(files.permissions_authority, permissions_authority->get()); !s) return failed(s);
  if (EVP_PKEY_eq(X509_get0_pubkey(identity_authority->get()), X509_get0_pubkey(permissions_authority->get())) == 1)
    return wrong(files.permissions_authority,
                 "is the authority of identity-ca.pem, so that everybody could sign permissions for himself; make two "
                 "with gatefield-keys init");
  if (wanted.name.empty()) files.identity.name = common_name(certificate->get());
  if (auto s = check_identity(files, certificate->get(), !wanted.name.empty()); !s) return failed(s);
  if (auto s = check_certificate(files, certificate->get(), identity_authority->get(), revoked->get()); !s)
    return failed(s);
  if (auto s = check_key(files.key, certificate->get()); !s) return failed(s);

  const auto rules = read_signed(files.governance, permissions_authority->get());
  if (!rules) return rules.failure();
  if (auto s = check_governance(files.governance, *rules); !s) return failed(s);
  const auto grants = read_signed(files.permissions, permissions_authority->get());
  if (!grants) return grants.failure();
  const std::string subject = text_of(X509_get_subject_name(certificate->get()));
  if (auto s = check_permissions(files.permissions, *grants, subject); !s) return failed(s);
  return files;
}

}  // namespace gatefield::dds
