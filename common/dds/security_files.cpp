// SPDX-License-Identifier: Apache-2.0
// What Fast DDS answers with a null participant is checked here first, so that the one line names
// the file. libcrypto is what Fast DDS itself links and its development package brings.
#include <openssl/pem.h>
#include <openssl/pkcs7.h>
#include <openssl/x509.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <memory>
#include <sstream>

#include "common/dds/participant.h"
#include "common/dds/security.h"

namespace zerodrift::dds {
namespace {

// Who has a certificate of its own (deploy/security/make_certificates.sh).
constexpr std::array<std::string_view, 6> kServices{"gyro_publisher", "thermal_publisher",
                                                    "compensation",   "allan_monitor",
                                                    "console",        "navigation_filter"};

constexpr std::uint32_t kHighestDomain = 232;

template <typename T, void (*Free)(T*)>
struct Freed {
  void operator()(T* object) const { Free(object); }
};
using Certificate = std::unique_ptr<X509, Freed<X509, X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY, EVP_PKEY_free>>;
using Store = std::unique_ptr<X509_STORE, Freed<X509_STORE, X509_STORE_free>>;
using StoreContext = std::unique_ptr<X509_STORE_CTX, Freed<X509_STORE_CTX, X509_STORE_CTX_free>>;
using Signature = std::unique_ptr<PKCS7, Freed<PKCS7, PKCS7_free>>;
using Stream = std::unique_ptr<BIO, Freed<BIO, BIO_free_all>>;
struct Closed {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, Closed>;

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& what) {
  throw DdsError("security: " + path.string() + ' ' + what);
}

File open(const std::filesystem::path& path) {
  File file(std::fopen(path.c_str(), "re"));
  if (!file) refuse(path, std::string("can't be read: ") + std::strerror(errno));
  return file;
}

Certificate read_certificate(const std::filesystem::path& path) {
  Certificate certificate(PEM_read_X509(open(path).get(), nullptr, nullptr, nullptr));
  if (!certificate) refuse(path, "is not a certificate in PEM form");
  return certificate;
}

Key read_key(const std::filesystem::path& path) {
  // An empty pass phrase: nobody is there to be asked for one.
  std::array<char, 1> none{};
  Key key(PEM_read_PrivateKey(open(path).get(), nullptr, nullptr, none.data()));
  if (!key) refuse(path, "is not an unencrypted private key in PEM form");
  return key;
}

std::string common_name(X509& certificate) {
  std::array<char, 256> name{};
  const int length = X509_NAME_get_text_by_NID(X509_get_subject_name(&certificate), NID_commonName,
                                               name.data(), static_cast<int>(name.size()));
  return length > 0 ? name.data() : "";
}

// ISO 8601 in UTC, which sorts by time; the permissions have it without the zone.
std::string text_of(const std::tm& utc) {
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &utc);
  return text.data();
}

std::string text_of(std::time_t time) {
  std::tm utc{};
  gmtime_r(&time, &utc);
  return text_of(utc);
}

std::string text_of(const ASN1_TIME* time) {
  std::tm utc{};
  return ASN1_TIME_to_tm(time, &utc) == 1 ? text_of(utc) : "an unknown time";
}

// A date alone is no answer where a computer's clock is behind by hours.
[[noreturn]] void refuse_at(const std::filesystem::path& path, const std::string& what,
                            const std::string& time, std::time_t now) {
  refuse(path, what + ' ' + time + "Z; this computer's clock says " + text_of(now) + 'Z');
}

void check_private(const std::filesystem::path& key) {
  struct stat status {};
  if (::stat(key.c_str(), &status) != 0) refuse(key, "can't be read");
  if ((status.st_mode & (S_IRWXG | S_IRWXO)) == 0) return;
  std::ostringstream mode;
  mode << std::oct << (status.st_mode & 0777U);
  refuse(key,
         "may be read or changed by others than its owner (mode " + mode.str() + "); expected 600");
}

void check_valid(const std::filesystem::path& path, const X509& certificate, std::time_t now) {
  const ASN1_TIME* begin = X509_get0_notBefore(&certificate);
  const ASN1_TIME* end = X509_get0_notAfter(&certificate);
  if (X509_cmp_time(end, &now) < 0) refuse_at(path, "has expired on", text_of(end), now);
  if (X509_cmp_time(begin, &now) > 0) refuse_at(path, "is not valid before", text_of(begin), now);
}

void check_signed(const std::filesystem::path& path, X509& certificate,
                  const std::filesystem::path& authority, std::time_t now) {
  const Certificate issuer = read_certificate(authority);
  check_valid(authority, *issuer, now);
  const Store store(X509_STORE_new());
  const StoreContext context(X509_STORE_CTX_new());
  const bool ready = store && context && X509_STORE_add_cert(store.get(), issuer.get()) == 1 &&
                     X509_STORE_CTX_init(context.get(), store.get(), &certificate, nullptr) == 1;
  if (!ready) throw DdsError("security: no memory to check certificates");
  X509_STORE_CTX_set_time(context.get(), 0, now);
  if (X509_verify_cert(context.get()) != 1) refuse(path, "is not signed by " + authority.string());
}

// The content of an S/MIME document, if the authority signed it.
std::string read_signed(const std::filesystem::path& path, const std::filesystem::path& authority) {
  const Certificate signer = read_certificate(authority);
  const Store store(X509_STORE_new());
  const Stream in(BIO_new_file(path.c_str(), "r"));
  const Stream out(BIO_new(BIO_s_mem()));
  if (!store || !in || !out || X509_STORE_add_cert(store.get(), signer.get()) != 1) {
    refuse(path, "can't be read");
  }
  BIO* detached = nullptr;
  const Signature signature(SMIME_read_PKCS7(in.get(), &detached));
  const Stream text(detached);
  if (!signature) refuse(path, "is not a signed document (S/MIME)");
  if (PKCS7_verify(signature.get(), nullptr, store.get(), text.get(), out.get(), PKCS7_TEXT) != 1) {
    refuse(path, "is not signed by " + authority.string());
  }
  char* content = nullptr;
  const long size = BIO_get_mem_data(out.get(), &content);
  return {content, static_cast<std::size_t>(size)};
}

// Between the first such tags; empty without.
std::string element(const std::string& document, const std::string& tag) {
  const auto begin = document.find('<' + tag + '>');
  const auto end = document.find("</" + tag + '>');
  if (begin == std::string::npos || end == std::string::npos || end < begin) return "";
  const auto content = begin + tag.size() + 2;
  return document.substr(content, end - content);
}

// For the clear line alone: the middleware parses the document in full.
void check_permissions(const std::filesystem::path& path, const std::string& document,
                       const std::string& identity, std::time_t now) {
  const std::string subject = element(document, "subject_name");
  if (!subject.starts_with("CN=" + identity + ',')) {
    refuse(path,
           "holds the permissions of '" + subject + "', expected those of 'CN=" + identity + "'");
  }
  const std::string begin = element(document, "not_before").substr(0, text_of(now).size());
  const std::string end = element(document, "not_after").substr(0, text_of(now).size());
  if (end < text_of(now)) refuse_at(path, "has expired on", end, now);
  if (begin > text_of(now)) refuse_at(path, "is not valid before", begin, now);
}

// Each <id> and <id_range> of a governance or of permissions, as text and as what it holds; a
// document without any is the middleware's to judge.
void check_domains(const std::filesystem::path& path, std::string_view document,
                   std::uint32_t domain) {
  std::string found;
  const auto number = [](const std::string& text, std::uint32_t otherwise) {
    std::uint32_t value = otherwise;
    std::from_chars(text.data(), text.data() + text.size(), value);
    return value;
  };
  for (auto at = document.find("<id"); at != std::string_view::npos;
       at = document.find("<id", at + 1)) {
    const std::string rest(document.substr(at));
    const bool is_range = rest.starts_with("<id_range>");
    if (!is_range && !rest.starts_with("<id>")) continue;
    const std::string content = element(rest, is_range ? "id_range" : "id");
    const std::uint32_t lowest = number(is_range ? element(content, "min") : content, 0);
    const std::uint32_t highest =
        is_range ? number(element(content, "max"), kHighestDomain) : lowest;
    if (domain >= lowest && domain <= highest) return;
    found +=
        (found.empty() ? "" : ", ") + std::to_string(lowest) + " to " + std::to_string(highest);
  }
  if (found.empty()) return;
  refuse(path, "is for domains " + found + ", found domain " + std::to_string(domain));
}

void check_exists(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) {
    refuse(path, "is missing; deploy/security/make_certificates.sh makes it");
  }
  if (::access(path.c_str(), R_OK) != 0) refuse(path, "can't be read by this user");
}

}  // namespace

std::string security_identity(std::string_view participant_name) {
  const std::string_view name = participant_name.substr(0, participant_name.find('/'));
  const bool has_its_own = std::find(kServices.begin(), kServices.end(), name) != kServices.end();
  return std::string(has_its_own ? name : "zerodrift");
}

SecurityFiles find_security_files(const std::filesystem::path& folder, const std::string& identity,
                                  std::uint32_t domain, std::chrono::system_clock::time_point now) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder, ignored)) refuse(folder, "is not a folder");
  const std::filesystem::path own = folder / identity;
  if (!std::filesystem::is_directory(own, ignored)) {
    refuse(folder, "holds nothing for '" + identity + "'; expected the folder " + own.string());
  }
  const SecurityFiles files{.identity_ca = folder / "identity_ca.pem",
                            .permissions_ca = folder / "permissions_ca.pem",
                            .governance = folder / "governance.p7s",
                            .certificate = own / "certificate.pem",
                            .key = own / "key.pem",
                            .permissions = own / "permissions.p7s"};
  for (const auto* file : {&files.identity_ca, &files.permissions_ca, &files.governance,
                           &files.certificate, &files.key, &files.permissions}) {
    check_exists(*file);
  }
  check_private(files.key);
  const std::time_t time = std::chrono::system_clock::to_time_t(now);
  const Certificate certificate = read_certificate(files.certificate);
  if (const std::string name = common_name(*certificate); name != identity) {
    refuse(files.certificate, "is the certificate of '" + name + "', expected '" + identity + "'");
  }
  check_valid(files.certificate, *certificate, time);
  check_signed(files.certificate, *certificate, files.identity_ca, time);
  const Key key = read_key(files.key);
  if (X509_check_private_key(certificate.get(), key.get()) != 1) {
    refuse(files.key, "does not belong to " + files.certificate.string());
  }
  check_domains(files.governance, read_signed(files.governance, files.permissions_ca), domain);
  const std::string permissions = read_signed(files.permissions, files.permissions_ca);
  check_permissions(files.permissions, permissions, identity, time);
  check_domains(files.permissions, permissions, domain);
  return files;
}

}  // namespace zerodrift::dds
