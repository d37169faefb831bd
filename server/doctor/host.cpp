// SPDX-License-Identifier: MIT
#include "server/doctor/host.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <exception>
#include <fstream>
#include <system_error>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/timex.h>
#include <unistd.h>

#include "server/endpoint/datagram/udp_port.h"
#include "server/endpoint/listen/listen.h"
#include "server/tls/certificate.h"

namespace clothstream::doctor {
namespace {

constexpr double kDaysOfAdvice = 21;  // automatic renewal acts a month before the end

}  // namespace

Finding checkPort(const std::string& host, std::uint16_t port, const char* option) {
  Finding finding{.level = Level::good,
                  .topic = "port",
                  .text = fmt::format("{}: {} port {} is free", option, host, port)};
  if (port == 0) {
    finding.text = fmt::format("{}: any free port", option);
    return finding;
  }
  try {
    boost::asio::io_context io;
    endpoint::listen(io, host, port, option);
  } catch (const std::exception& error) {
    finding.level = Level::problem;
    finding.text = error.what();
    finding.fix = fmt::format("`ss -ltnp` shows which program uses a port. {} chooses another port", option);
  }
  return finding;
}

Findings checkDatagramPort(const endpoint::DatagramEndpointOptions& options, bool required) {
  const auto listOf = [](const std::vector<std::string>& addresses) {
    return addresses.empty() ? "none" : fmt::format("{}", fmt::join(addresses, ", "));
  };
  Finding finding{.level = Level::good, .topic = "port", .text = {}};
  finding.figures = {{"ownAddresses", options.ownAddresses}, {"publicAddresses", options.publicAddresses}};
  try {
    boost::asio::io_context io;
    const endpoint::UdpPort udp(io, options.host, options.port);
    const std::string port = options.port == 0
                                 ? "any free UDP port"
                                 : fmt::format("{} UDP port {} is free", options.host, options.port);
    finding.text = fmt::format(
        "--datagram-port: {}{}. Clients try the address that they have reached (gRPC: {}), and "
        "--public-address ({})",
        port, udp.hasIpv6() ? "" : ", for IPv4 alone: the kernel has no IPv6 sockets",
        listOf(options.ownAddresses), listOf(options.publicAddresses));
    const endpoint::UdpPort::Queues queues = udp.queues();
    return {finding, checkUdpQueues(queues.receive, queues.send)};
  } catch (const std::exception& error) {
    finding.level = required ? Level::problem : Level::advice;
    finding.text = fmt::format("{}{}", error.what(), required ? "" : "; clients stay on their streams");
    finding.fix =
        "`ss -lunp` shows which program uses a port. --datagram-port chooses another one; --transport tcp "
        "says "
        "that datagrams are not wanted";
    return {finding};
  }
}

Finding checkUdpQueues(int receiveBytes, int sendBytes) {
  constexpr int kWanted = endpoint::UdpPort::kQueueBytes;
  Finding finding{.level = Level::good,
                  .topic = "udp",
                  .text = fmt::format("queues of {} kB for arriving, {} kB for leaving datagrams",
                                      receiveBytes / 1024, sendBytes / 1024)};
  finding.figures = {{"receiveBytes", receiveBytes}, {"sendBytes", sendBytes}};
  if (std::min(receiveBytes, sendBytes) >= kWanted) return finding;
  finding.level = Level::advice;
  finding.text +=
      fmt::format(", instead of {} kB: with many clients the kernel drops datagrams, which costs repeats",
                  kWanted / 1024);
  finding.fix = fmt::format(
      "`sysctl -w net.core.rmem_max={0} net.core.wmem_max={0}` as root, and these two lines in "
      "/etc/sysctl.d/clothstream.conf for the next start of the machine",
      kWanted);
  return finding;
}

Finding checkCertificate(const std::filesystem::path& chain, const std::filesystem::path& key,
                         const std::vector<std::string>& names) {
  Finding finding{.level = Level::good, .topic = "certificate", .text = {}};
  try {
    const tls::Certificate certificate = tls::readCertificate(chain, key);
    const std::chrono::duration<double, std::ratio<86400>> left =
        tls::expiryOf(certificate) - std::chrono::system_clock::now();
    const std::vector<std::string> covered = tls::namesOf(certificate);
    finding.figures = {{"daysLeft", left.count()}, {"names", covered}};
    finding.text = fmt::format("{}: valid for {:.0f} more days, for {}", chain.string(),
                               std::max(0.0, left.count()), fmt::join(covered, ", "));
    if (left.count() <= 0) {
      finding.level = Level::problem;
      finding.text =
          fmt::format("{}: ended {:.0f} days ago; clients refuse it", chain.string(), -left.count());
      finding.fix = "Renew it, then send SIGHUP to the server, which reads it again";
      return finding;
    }
    std::vector<std::string> missing;
    for (const std::string& name : names)
      if (name != "*" && !tls::covers(certificate, name)) missing.push_back(name);
    if (!missing.empty()) {
      finding.level = Level::problem;
      finding.text += fmt::format("; not for {} (--public-name)", fmt::join(missing, ", "));
      finding.fix = "Get a certificate that has these names too";
    } else if (left.count() < kDaysOfAdvice) {
      finding.level = Level::advice;
      finding.fix = "Renew it, then send SIGHUP to the server, which reads it again";
    }
  } catch (const std::exception& error) {
    finding.level = Level::problem;
    finding.text = error.what();
    finding.fix = "Give --tls-certificate and --tls-key PEM files that belong together";
  }
  return finding;
}

Finding checkDirectory(const std::filesystem::path& directory, const char* option, double keepFreeMegabytes) {
  Finding finding{.level = Level::good, .topic = "directory", .text = {}};
  std::filesystem::path place = std::filesystem::absolute(directory);
  std::error_code error;
  while (!std::filesystem::exists(place, error) && place.has_relative_path()) place = place.parent_path();
  if (access(place.c_str(), W_OK | X_OK) != 0 || !std::filesystem::is_directory(place, error)) {
    finding.level = Level::problem;
    finding.text =
        fmt::format("{}: nothing can be written in {}: {}", option, place.string(),
                    std::filesystem::is_directory(place, error) ? std::strerror(errno) : "not a directory");
    finding.fix =
        fmt::format("Give the server's account the right to write there, or choose another with {}", option);
    return finding;
  }
  const std::filesystem::space_info space = std::filesystem::space(place, error);
  const double free = error ? 0 : static_cast<double>(space.available) / 1e6;
  finding.figures = {{"freeMegabytes", free}};
  finding.text = fmt::format("{}: {} can be written, {:.0f} MB are free", option, directory.string(), free);
  if (free < keepFreeMegabytes) {
    finding.level = Level::problem;
    finding.text += fmt::format(", but the server leaves {:.0f} MB free (--keep-free)", keepFreeMegabytes);
    finding.fix = "Free some room on this disk: below this limit nothing is recorded, and no states are kept";
  }
  return finding;
}

Finding checkCongestionControl(const std::string& used) {
  Finding finding{.level = Level::good, .topic = "tcp", .text = fmt::format("connections use {}", used)};
  finding.figures = {{"congestionControl", used}};
  if (used == endpoint::kCongestionControl) return finding;
  finding.level = Level::advice;
  finding.text =
      fmt::format("connections use {}: this kernel has no {}, which loses fewer frames on bad links",
                  used.empty() ? "an unknown congestion control" : used, endpoint::kCongestionControl);
  finding.fix = fmt::format(
      "`modprobe tcp_{0}` as root, and a line tcp_{0} in /etc/modules-load.d/{0}.conf for the next start of "
      "the machine",
      endpoint::kCongestionControl);
  return finding;
}

Finding checkClock() {
  Finding finding{.level = Level::good, .topic = "clock", .text = {}};
  timex request{};
  const int state = adjtimex(&request);
  const auto now = std::chrono::system_clock::now();
  finding.text =
      fmt::format("{:%F %T} UTC, synchronised", fmt::gmtime(std::chrono::system_clock::to_time_t(now)));
  if (state == TIME_ERROR || (request.status & STA_UNSYNC) != 0) {
    finding.level = Level::advice;
    finding.text = fmt::format("{:%F %T} UTC; the kernel does not know whether this is right",
                               fmt::gmtime(std::chrono::system_clock::to_time_t(now)));
    finding.fix =
        "Install an NTP client, such as Debian's systemd-timesyncd or chrony: tokens and certificates "
        "need the right time";
  }
  return finding;
}

}  // namespace clothstream::doctor
