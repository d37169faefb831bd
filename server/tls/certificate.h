// SPDX-License-Identifier: MIT
// Certificates of a server with their keys: read from files, or made for a home network.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

namespace clothstream::tls {

// As PEM text.
struct Certificate {
  std::string chain;  // the server's own certificate first
  std::string key;
};

// Throws std::runtime_error that names the file and the problem: unreadable, not PEM, or a key of another
// certificate.
Certificate readCertificate(const std::filesystem::path& chain, const std::filesystem::path& key);

// Returns whether accounts other than the owner of the file may read it. False if it does not exist.
bool othersMayRead(const std::filesystem::path& key);

// PEM text of a file with one or more certificates. Throws as readCertificate() does.
std::string readCertificates(const std::filesystem::path& file);

// End of the validity of the first certificate.
std::chrono::system_clock::time_point expiryOf(const Certificate& certificate);

// Whether the first certificate is for this host name or IP address.
bool covers(const Certificate& certificate, const std::string& name);

// Host names, some with a *, and IP addresses of the first certificate.
std::vector<std::string> namesOf(const Certificate& certificate);

// Host names and IP addresses of this machine under which a home network reaches it: the name of the machine
// with and without ".local", localhost, and the addresses of all interfaces.
std::vector<std::string> namesOfThisMachine();

// Reads `directory`/self.pem and self.key, and returns their certificate. Makes the key once, with mode 0600,
// and the certificate when it is missing, lacks one of `names`, or ends within 30 days. Throws
// std::runtime_error if the directory cannot be written.
Certificate selfSigned(const std::filesystem::path& directory, const std::vector<std::string>& names);

}  // namespace clothstream::tls
