// SPDX-License-Identifier: MIT
// Checks of the machine and its configuration that need no device.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "server/doctor/finding.h"
#include "server/endpoint/datagram/datagram_endpoint.h"

namespace clothstream::doctor {

// Whether a server can listen there. `option` names the port in texts; port 0 is any free port.
Finding checkPort(const std::string& host, std::uint16_t port, const char* option);

// Whether the server can open the UDP port for datagrams, and which addresses it names to clients.
// `required`: it does not start without the port.
Findings checkDatagramPort(const endpoint::DatagramEndpointOptions& options, bool required);

// Whether the kernel allows the bytes that a UDP port asks for in each of its queues.
Finding checkUdpQueues(int receiveBytes, int sendBytes);

// Validity and names of a certificate in PEM files. `names` are those by which clients reach the server.
Finding checkCertificate(const std::filesystem::path& chain, const std::filesystem::path& key,
                         const std::vector<std::string>& names);

// Whether files can be written there, or in the nearest parent that exists, and how much room the disk has.
// `keepFreeMegabytes` is what the server leaves free.
Finding checkDirectory(const std::filesystem::path& directory, const char* option, double keepFreeMegabytes);

// Whether TCP connections of the server have the congestion control that it asks for. `used` is the one that
// they have.
Finding checkCongestionControl(const std::string& used);

// Whether the kernel says that the clock is synchronised. Tokens and certificates need the right time.
Finding checkClock();

}  // namespace clothstream::doctor
