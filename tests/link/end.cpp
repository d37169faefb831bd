// SPDX-License-Identifier: MIT
// The child sends one message: what it has made, with the TUN device, or why it could not.
#include "tests/link/end.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/if.h>
#include <linux/if_tun.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/wait.h>

namespace clothstream::link {
namespace {

constexpr const char* kDevice = "link0";
// Packets that may wait to be read. Enough for large windows of TCP, so that only the link loses packets.
constexpr int kDeviceQueue = 10'000;
constexpr std::size_t kMaxMessage = 1000;
// First byte of the child's message; the rest is text.
constexpr char kReady = 'r', kFailed = 'f', kForbidden = 'n';

// Fails with the text of errno.
[[noreturn]] void forbid(const std::string& what) {
  throw NotPermitted(fmt::format("{}: {}", what, std::strerror(errno)));
}

void writeFile(const char* path, const std::string& text) {
  const Descriptor file(open(path, O_WRONLY | O_CLOEXEC));
  if (*file < 0 || ::write(*file, text.data(), text.size()) != static_cast<ssize_t>(text.size()))
    forbid(path);
}

// The user becomes root in its own namespace, and nothing else changes.
void makeNamespaces() {
  const uid_t user = geteuid();
  const gid_t group = getegid();
  if (unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) forbid("unshare");
  writeFile("/proc/self/setgroups", "deny");
  writeFile("/proc/self/uid_map", fmt::format("0 {} 1", user));
  writeFile("/proc/self/gid_map", fmt::format("0 {} 1", group));
}

Descriptor makeDevice() {
  Descriptor device(open("/dev/net/tun", O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (*device < 0) forbid("/dev/net/tun");
  ifreq request{};
  request.ifr_flags = IFF_TUN | IFF_NO_PI;
  std::strncpy(request.ifr_name, kDevice, IFNAMSIZ - 1);
  if (ioctl(*device, TUNSETIFF, &request) != 0) forbid("TUNSETIFF");
  return device;
}

bool hasIpv6() {
  std::ifstream file(fmt::format("/proc/sys/net/ipv6/conf/{}/disable_ipv6", kDevice));
  int disabled = 1;
  return file >> disabled && disabled == 0;
}

// Gives the device addresses and starts it. Returns the addresses.
std::vector<std::string> configure(const EndOptions& options) {
  struct Network {
    const char* prefix;
    const char* first;
    int bits;
  };
  // Private addresses (RFC 1918 and RFC 4193).
  std::vector<Network> networks{{"10.77.0.0", "10.77.0.", 24}};
  if (hasIpv6()) networks.push_back({"fd77::", "fd77::", 64});
  std::vector<std::string> addresses;
  std::string commands = "link set lo up\n";
  for (const Network& network : networks) {
    addresses.push_back(fmt::format("{}{}", network.first, options.number));
    // Without the search for duplicates, which would delay the first packets.
    commands += fmt::format("address add {}/{} dev {} noprefixroute{}\n", addresses.back(), network.bits,
                            kDevice, network.bits == 64 ? " nodad" : "");
  }
  commands += fmt::format("link set {} mtu {} txqueuelen {} up\n", kDevice, options.mtu, kDeviceQueue);
  // The algorithm of a route is not restricted to those that the machine permits for sockets.
  const std::string algorithm = options.congestion.empty() ? "" : " congctl " + options.congestion;
  for (const Network& network : networks)
    commands += fmt::format("route add {}/{} dev {}{}\n", network.prefix, network.bits, kDevice, algorithm);
  std::FILE* const ip = popen("ip -batch -", "w");
  if (ip == nullptr) throw std::runtime_error("sh cannot be started");
  std::fputs(commands.c_str(), ip);
  if (pclose(ip) != 0)
    throw std::runtime_error("`ip -batch` failed (package iproute2) with these commands:\n" + commands);
  return addresses;
}

void send(int channel, const std::string& text, int device = -1) {
  iovec data{const_cast<char*>(text.data()), text.size()};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  msghdr message{};
  message.msg_iov = &data;
  message.msg_iovlen = 1;
  if (device >= 0) {
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    cmsghdr* const rights = CMSG_FIRSTHDR(&message);
    rights->cmsg_level = SOL_SOCKET;
    rights->cmsg_type = SCM_RIGHTS;
    rights->cmsg_len = CMSG_LEN(sizeof(int));
    std::memcpy(CMSG_DATA(rights), &device, sizeof device);
  }
  sendmsg(channel, &message, MSG_NOSIGNAL);
}

struct Received {
  std::string text;  // empty: the child ended
  Descriptor device;
};
Received receive(int channel) {
  std::string text(kMaxMessage, '\0');
  iovec data{text.data(), text.size()};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  msghdr message{};
  message.msg_iov = &data;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  ssize_t bytes = -1;
  do bytes = recvmsg(channel, &message, MSG_CMSG_CLOEXEC);
  while (bytes < 0 && errno == EINTR);
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(bytes, 0)));
  int device = -1;
  const cmsghdr* const rights = CMSG_FIRSTHDR(&message);
  if (bytes > 0 && rights != nullptr && rights->cmsg_type == SCM_RIGHTS)
    std::memcpy(&device, CMSG_DATA(rights), sizeof device);
  return {std::move(text), Descriptor(device)};
}

// Runs in the child until the other end of the channel is closed.
[[noreturn]] void hold(int channel, const EndOptions& options) {
  // The other end of an earlier child's channel must not stay open here.
  constexpr int kChannel = 3;
  dup2(channel, kChannel);
  close_range(kChannel + 1, ~0u, 0);
  // A terminal sends these to all programs of a command. The parent decides when this one ends.
  std::signal(SIGINT, SIG_IGN);
  std::signal(SIGTERM, SIG_IGN);
  try {
    makeNamespaces();
    const Descriptor device = makeDevice();
    std::string text(1, kReady);
    for (const std::string& address : configure(options)) text += address + ' ';
    send(kChannel, text, *device);
  } catch (const NotPermitted& error) {
    send(kChannel, kForbidden + std::string(error.what()));
  } catch (const std::exception& error) {
    send(kChannel, kFailed + std::string(error.what()).substr(0, kMaxMessage - 1));
  }
  char ignored = 0;
  while (::read(kChannel, &ignored, 1) > 0) continue;
  _exit(0);
}

}  // namespace

End::End(const EndOptions& options) {
  std::array<int, 2> sockets{};
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, sockets.data()) != 0)
    throw std::runtime_error(fmt::format("socketpair: {}", std::strerror(errno)));
  lifeline_ = Descriptor(sockets[0]);
  const Descriptor childs(sockets[1]);
  pid_ = fork();
  if (pid_ < 0) throw std::runtime_error(fmt::format("fork: {}", std::strerror(errno)));
  if (pid_ == 0) hold(*childs, options);
  Received received = receive(*lifeline_);
  if (received.text.empty()) throw std::runtime_error("the process of a namespace ended");
  const std::string text = received.text.substr(1);
  if (received.text[0] == kForbidden) throw NotPermitted(text);
  if (received.text[0] == kFailed) throw std::runtime_error(text);
  device_ = std::move(received.device);
  std::istringstream words(text);
  for (std::string address; words >> address;) addresses_.push_back(address);
}

End::~End() {
  lifeline_ = Descriptor();
  waitpid(pid_, nullptr, 0);
}

std::uint64_t End::overflowed() const {
  std::ifstream file(fmt::format("/proc/{}/net/dev", pid_));
  for (std::string line; std::getline(file, line);) {
    const std::size_t name = line.find(std::string(kDevice) + ':');
    if (name == std::string::npos) continue;
    // Eight columns of what the device has received, and then bytes, packets, errors and drops of what it
    // sent.
    std::istringstream columns(line.substr(line.find(':') + 1));
    std::uint64_t value = 0;
    for (int column = 0; column < 12; ++column) columns >> value;
    return value;
  }
  throw std::runtime_error(fmt::format("{} has vanished", kDevice));
}

}  // namespace clothstream::link
